// What all landmarks together teach of detector and world, and what that says
// of each of them.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "services/existence_tracker/tracked_point.hpp"

namespace understory::existence_tracker {

/// The landmarks that are tracked, by their ids.
using PointsById = std::map<model::LandmarkId, TrackedPoint>;

/// Keeps what became of the landmarks as counts that follow what changes, and
/// sums them up: how often a pass misses what is there, how much goes, and how
/// much of what is new is real.
class Lessons {
 public:
  /// Nothing is learned. Throws std::invalid_argument where a parameter of the
  /// model cannot be.
  explicit Lessons(const existence::Parameters& parameters)
      : expected_birth_(parameters.birth), model_(parameters) {}

  /// The model by which every landmark is judged.
  existence::ExistenceModel& model() { return model_; }
  const existence::ExistenceModel& model() const { return model_; }
  /// Path at the last sum [m].
  double learned_m() const { return learned_m_; }

  /// A point that is new here: it follows what is known.
  void begin(model::LandmarkId id, TrackedPoint& tracked);
  /// Before a landmark's point changes.
  void change(model::LandmarkId id, TrackedPoint& tracked);
  /// Before a landmark is erased.
  void forget(const TrackedPoint& tracked);
  /// Sums up. `along_m`: path so far. O(what changed, histories that differ).
  void learn(PointsById& points, double along_m);
  /// P anew by what was learned since it was last judged; false where nothing
  /// was.
  bool judge(model::LandmarkId id, TrackedPoint& tracked);
  /// Whether the point follows the last sum.
  bool is_judged(const TrackedPoint& tracked) const {
    return tracked.judged_times == learned_times_;
  }

  /// Counts a landmark that is seen by another pass than the one that found it.
  void confirm(TrackedPoint& tracked);
  /// Counts a landmark that another pass, which is over, looked for, and that
  /// is below `improbable` now. In its first pass nothing counts: nothing can
  /// be confirmed there either.
  void count_false(TrackedPoint& tracked, double improbable);
  /// While most of what is new turns out to be false, it is not used before
  /// another pass saw it.
  bool are_new_ones_used() const;

  /// What became of these landmarks, as it is counted now.
  existence::PassHistories histories(const PointsById& points) const;

  /// What was learned, for the next drive or process.
  std::string encoded() const { return encode(model_, births_); }
  /// Goes on with what encoded() gave. Throws std::invalid_argument; nothing is
  /// changed then.
  void take(std::string_view bytes) { decode(bytes, model_, births_); }
  /// Other landmarks from now on, of which none is counted yet: restore() each.
  void begin_anew();
  /// A landmark with a history. `is_judged`: P follows the last sum.
  void restore(model::LandmarkId id, TrackedPoint& tracked, bool is_judged);

  /// Members of a saved state; see common/state. What was learned is in
  /// encoded(), the histories follow from the landmarks: restore() each after a
  /// load.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.learned_m_);
  }

 private:
  double expected_birth_;
  existence::ExistenceModel model_;
  BirthCounts births_;
  existence::PassHistories histories_;      ///< Of all landmarks but those that changed since:
  std::vector<model::LandmarkId> changed_;  ///< since the last sum, and perhaps gone.
  std::uint64_t learned_times_ = 0;
  double learned_m_ = 0.0;
};

}  // namespace understory::existence_tracker
