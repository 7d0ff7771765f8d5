// Statistics of all landmarks about detector and world, and their effect on each landmark.
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

/// Keeps counts of the landmarks' histories, updated incrementally, and estimates from them: the
/// share of existing landmarks that a pass misses, the rate of disappearance, and the share of new
/// landmarks that are real.
class Lessons {
 public:
  /// No statistics yet. Throws std::invalid_argument on invalid parameters of the model.
  explicit Lessons(const existence::Parameters& parameters)
      : expected_birth_(parameters.birth), model_(parameters) {}

  /// The model for all landmarks.
  existence::ExistenceModel& model() { return model_; }
  const existence::ExistenceModel& model() const { return model_; }
  /// Path at the last estimate [m].
  double learned_m() const { return learned_m_; }

  /// A new landmark: its point starts with the present estimates.
  void begin(model::LandmarkId id, TrackedPoint& tracked);
  /// Before a landmark's point changes.
  void change(model::LandmarkId id, TrackedPoint& tracked);
  /// Before a landmark is erased.
  void forget(const TrackedPoint& tracked);
  /// Updates the estimates. `along_m`: path so far. O(changed landmarks, distinct histories).
  void learn(PointsById& points, double along_m);
  /// Updates P with the estimates since its last update; false if there are none.
  bool judge(model::LandmarkId id, TrackedPoint& tracked);
  /// Whether the point is up to date with the last estimate.
  bool is_judged(const TrackedPoint& tracked) const {
    return tracked.judged_times == learned_times_;
  }

  /// Counts a landmark that a later pass than its first one saw.
  void confirm(TrackedPoint& tracked);
  /// Counts a landmark as false if a later pass, now finished, looked for it and its P is below
  /// `improbable`. In its first pass nothing is counted, as nothing can be confirmed then, either.
  void count_false(TrackedPoint& tracked, double improbable);
  /// While most new landmarks turn out to be false, they are not used before a later pass sees
  /// them.
  bool are_new_ones_used() const;

  /// Histories of these landmarks as counted now.
  existence::PassHistories histories(const PointsById& points) const;

  /// The estimates, for the next drive or process.
  std::string encoded() const { return encode(model_, births_); }
  /// Continues with the output of encoded(). Throws std::invalid_argument without change.
  void take(std::string_view bytes) { decode(bytes, model_, births_); }
  /// Starts with other landmarks, none counted yet: call restore() for each.
  void begin_anew();
  /// Adds a landmark with a history. `is_judged`: P is up to date with the last estimate.
  void restore(model::LandmarkId id, TrackedPoint& tracked, bool is_judged);

  /// Members of a saved state; see common/state. The estimates are in encoded(), the histories
  /// follow from the landmarks: call restore() for each after a load.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.learned_m_);
  }

 private:
  double expected_birth_;
  existence::ExistenceModel model_;
  BirthCounts births_;
  existence::PassHistories histories_;      ///< Of all landmarks except changed_.
  std::vector<model::LandmarkId> changed_;  ///< Since the last estimate; perhaps erased.
  std::uint64_t learned_times_ = 0;
  double learned_m_ = 0.0;
};

}  // namespace understory::existence_tracker
