// The existence tracker without its process: which landmarks of the map are
// still there.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/model/existence.hpp"
#include "common/model/slam_output.hpp"
#include "services/existence_tracker/driven_path.hpp"
#include "services/existence_tracker/landmark_places.hpp"
#include "services/existence_tracker/lessons.hpp"
#include "services/existence_tracker/mapping_need.hpp"
#include "services/existence_tracker/news.hpp"
#include "services/existence_tracker/parameters.hpp"
#include "services/existence_tracker/use_of_landmarks.hpp"

namespace understory::existence_tracker {

/// Looks so far.
struct LookCounters {
  std::uint64_t hits = 0;
  std::uint64_t misses = 0;
  std::uint64_t blocked = 0;        ///< Of the misses: hidden behind something.
  std::uint64_t clear = 0;          ///< Of the misses: the beams went on behind the place.
  std::uint64_t without_place = 0;  ///< Looks at landmarks of which no message said where they are.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.hits, s.misses, s.blocked, s.clear, s.without_place);
  }
};

/// What the tracker has done so far.
struct TrackerCounters : LookCounters {
  std::uint64_t dropped = 0;     ///< Landmarks taken out of use ...
  std::uint64_t readmitted = 0;  ///< ... and into use again.
};

/// Follows the mapper: each keyframe says which landmarks it saw, and which it
/// should have seen and did not, with what the sensor measured along the ray.
/// What was hidden says nothing of the landmark; what was in clear view and not
/// seen says more than a mere miss. For every landmark it keeps the probability
/// that it exists, and the shell from which it can be seen (common/existence;
/// thesis 003). A landmark that is improbable is not to be used; it is kept and
/// looked for, and in use again when it is seen. It never associates by itself.
///
/// What all landmarks have taught is summed up every 100 m of path, from counts
/// that follow what changed. P of a landmark follows where it is near, looked
/// at or told.
///
/// Memory: some 300 bytes per landmark. Time: what a keyframe looks at and,
/// every 100 m, what is around; all landmarks where a drive begins.
class ExistenceTracker {
 public:
  /// Without landmarks. Throws std::invalid_argument where a parameter of the
  /// model cannot be.
  explicit ExistenceTracker(const TrackerParameters& parameters = {});

  /// Goes on with landmarks of an earlier drive; a new pass begins. Throws
  /// std::invalid_argument where a state is none of this version: nothing is
  /// changed then.
  void begin_with(std::span<const model::ExistenceState> states);

  /// MAP, MAP_DELTA: where the landmarks are. New ones get their probability
  /// now.
  void on_map(const model::WholeMap& map);
  void on_delta(const model::MapDelta& delta);

  /// SLAM_UPDATE. None where the keyframe has no place.
  std::optional<model::Existence> on_update(const model::MapUpdate& update);

  /// What has changed since it was told last, up to 200 landmarks each: for a
  /// store.
  std::vector<model::ExistenceState> take_states();

  /// The probability of a landmark that is known.
  std::optional<model::LandmarkExistence> of(model::LandmarkId id) const;
  /// What was done so far.
  TrackerCounters counters() const { return {looks_, use_.dropped(), use_.readmitted()}; }
  /// What became of the landmarks, as it is counted now and counted anew: the
  /// same.
  existence::PassHistories histories() const { return lessons_.histories(points_); }
  existence::PassHistories recount() const;
  /// Landmarks are looked at of which no message said where they are: the whole
  /// map is wanted.
  bool wants_map() const { return wants_map_; }

  /// The state as bytes; load() goes on with it. Throws std::invalid_argument.
  std::string save() const;
  void load(const std::string& state);

 private:
  /// A landmark that was added, before it is known where.
  struct Birth {
    model::LandmarkId id = 0;
    Eigen::Vector2d vehicle_m = Eigen::Vector2d::Zero();  ///< Frame map.
    model::Utime utime = 0;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.id, s.vehicle_m, s.utime);
    }
  };
  /// Of the last keyframe.
  struct LastKeyframe {
    model::Utime utime = 0;
    std::uint32_t map_id = 1;
    bool begins_drive = false;  ///< The next one is the first one with these landmarks.

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.utime, s.map_id, s.begins_drive);
    }
  };
  void begin_drive(model::Utime utime);
  void judge(model::LandmarkId id, TrackedPoint& tracked);
  void learn_on_the_way();
  void judge_around();
  void pass_time(model::Utime utime, TrackedPoint& tracked) const;
  void drive_to(const model::MapUpdate& update);
  void look(model::LandmarkId id, bool is_hit, existence::Ray ray, const model::MapUpdate& update);
  void count_need(model::LandmarkId id, const TrackedPoint& tracked, bool is_hit, double before);
  bool goes_on(TrackedPoint& tracked, model::Utime utime) const;
  TrackedPoint& known(model::LandmarkId id, model::Utime utime);
  void begin(model::LandmarkId id, TrackedPoint& tracked);
  void give_birth();
  void erase(model::LandmarkId id);
  void forget(const model::MapUpdate& update);
  void merge(model::LandmarkId old_id, model::LandmarkId new_id);
  bool may_be_used(const TrackedPoint& tracked) const {
    return tracked.is_confirmed || lessons_.are_new_ones_used();
  }
  model::Existence tell(const model::MapUpdate& update);
  void tell_new(model::Utime utime, model::Existence& existence) const;

  TrackerParameters parameters_;
  LandmarkPlaces places_;
  MappingNeed need_;
  DrivenPath path_;
  Lessons lessons_;
  UseOfLandmarks use_;
  News news_;
  PointsById points_;
  std::vector<Birth> births_;
  LookCounters looks_;
  LastKeyframe last_;
  bool wants_map_ = false;
};

}  // namespace understory::existence_tracker
