// The existence tracker without its process: which landmarks of the map still exist.
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
  std::uint64_t blocked = 0;        ///< Misses: the landmark was occluded.
  std::uint64_t clear = 0;          ///< Misses: the beams passed behind its position.
  std::uint64_t without_place = 0;  ///< Looks at landmarks of unknown position.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.hits, s.misses, s.blocked, s.clear, s.without_place);
  }
};

/// Counts since the tracker began.
struct TrackerCounters : LookCounters {
  std::uint64_t dropped = 0;     ///< Landmarks taken out of use ...
  std::uint64_t readmitted = 0;  ///< ... and into use again.
};

/// Follows the mapper: each keyframe lists the landmarks that it saw and those that it expected but
/// did not see, with the sensor's measurement along the ray. An occluded landmark is no evidence; a
/// landmark missing in clear view is stronger evidence than a mere miss. For every landmark it
/// keeps the probability of existence, and the shell from which it is visible (common/existence;
/// thesis 003). An improbable landmark is out of use; it is kept and looked for, and is in use
/// again when it is seen. The tracker makes no associations itself.
///
/// Statistics of all landmarks are evaluated every 100 m of path, from counts that are updated
/// incrementally. P of a landmark is updated when it is near, looked at or published.
///
/// Memory: some 300 bytes per landmark. Time: the landmarks that a keyframe looks at and, every
/// 100 m, those around; all landmarks at the start of a drive.
class ExistenceTracker {
 public:
  /// Without landmarks. Throws std::invalid_argument on invalid parameters of the model.
  explicit ExistenceTracker(const TrackerParameters& parameters = {});

  /// Continues with landmarks of an earlier drive; a new pass begins. Throws std::invalid_argument,
  /// without change, if a state is not of this version.
  void begin_with(std::span<const model::ExistenceState> states);

  /// MAP, MAP_DELTA: positions of the landmarks. New ones get their probability now.
  void on_map(const model::WholeMap& map);
  void on_delta(const model::MapDelta& delta);

  /// SLAM_UPDATE. None if the keyframe was not localised.
  std::optional<model::Existence> on_update(const model::MapUpdate& update);

  /// States that have changed since the last call, up to 200 landmarks each: for a store.
  std::vector<model::ExistenceState> take_states();

  /// The probability of a landmark; none if it is unknown.
  std::optional<model::LandmarkExistence> of(model::LandmarkId id) const;
  /// Counts so far.
  TrackerCounters counters() const { return {looks_, use_.dropped(), use_.readmitted()}; }
  /// Histories of the landmarks by passes; the incremental count equals a new count.
  existence::PassHistories histories() const { return lessons_.histories(points_); }
  existence::PassHistories recount() const;
  /// Whether landmarks of unknown position are looked at: then the whole map is needed.
  bool wants_map() const { return wants_map_; }

  /// The state as bytes; load() continues with it. Throws std::invalid_argument.
  std::string save() const;
  void load(const std::string& state);

 private:
  /// A new landmark whose position is not known yet.
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
    bool begins_drive = false;  ///< The next keyframe is the first one with these landmarks.

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
