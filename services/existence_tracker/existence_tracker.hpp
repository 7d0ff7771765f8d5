// The existence tracker without its process: which landmarks of the map are still there.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "common/model/existence.hpp"
#include "common/model/slam_output.hpp"
#include "services/existence_tracker/landmark_places.hpp"
#include "services/existence_tracker/mapping_need.hpp"
#include "services/existence_tracker/parameters.hpp"
#include "services/existence_tracker/tracked_point.hpp"

namespace understory::existence_tracker {

/// What the tracker has done so far.
struct TrackerCounters {
  std::uint64_t hits = 0;
  std::uint64_t misses = 0;
  std::uint64_t blocked = 0;        ///< Of the misses: hidden behind something.
  std::uint64_t clear = 0;          ///< Of the misses: the beams went on behind the place.
  std::uint64_t without_place = 0;  ///< Looks at landmarks of which no message said where they are.
  std::uint64_t dropped = 0;        ///< Landmarks taken out of use ...
  std::uint64_t readmitted = 0;     ///< ... and into use again.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.hits, s.misses, s.blocked, s.clear, s.without_place, s.dropped, s.readmitted);
  }
};

/// Follows the mapper: each keyframe says which landmarks it saw, and which it should have seen and
/// did not, with what the sensor measured along the ray. What was hidden says nothing of the
/// landmark; what was in clear view and not seen says more than a mere miss. For every landmark it
/// keeps the probability that it exists, and the shell from which it can be seen (common/existence;
/// thesis 003). A landmark that is improbable is not to be used; it is kept and looked for, and in
/// use again when it is seen. It never associates by itself.
///
/// What all landmarks have taught is summed up every 100 m of path, from counts that follow what
/// changed. P of a landmark follows where it is near, looked at or told.
///
/// Memory: some 300 bytes per landmark. Time: what a keyframe looks at and, every 100 m, what is
/// around; all landmarks where a drive begins.
class ExistenceTracker {
 public:
  /// Without landmarks. Throws std::invalid_argument where a parameter of the model cannot be.
  explicit ExistenceTracker(const TrackerParameters& parameters = {});

  /// Goes on with landmarks of an earlier drive; a new pass begins. Throws std::invalid_argument
  /// where a state is none of this version: nothing is changed then.
  void begin_with(std::span<const model::ExistenceState> states);

  /// MAP, MAP_DELTA: where the landmarks are. New ones get their probability now.
  void take(const model::WholeMap& map);
  void take(const model::MapDelta& delta);

  /// SLAM_UPDATE. None where the keyframe has no place.
  std::optional<model::Existence> add(const model::MapUpdate& update);

  /// What has changed since it was told last, up to 200 landmarks each: for a store.
  std::vector<model::ExistenceState> take_states();

  /// The probability of a landmark that is known.
  std::optional<model::LandmarkExistence> of(model::LandmarkId id) const;
  /// What was done so far.
  const TrackerCounters& counters() const { return counters_; }
  /// What became of the landmarks, as it is counted now and counted anew: the same.
  existence::PassHistories histories() const;
  existence::PassHistories recount() const;
  /// Landmarks are looked at of which no message said where they are: the whole map is wanted.
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
  void begin_drive(model::Utime utime);
  void learn();
  void change(model::LandmarkId id, TrackedPoint& tracked);
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
  void make_due(model::LandmarkId id, TrackedPoint& tracked);
  void give_birth();
  void forget(const model::MapUpdate& update);
  void confirm(TrackedPoint& tracked);
  void count_false(TrackedPoint& tracked);
  bool may_be_used(const TrackedPoint& tracked) const;
  bool are_new_ones_used() const;
  void take_back(TrackedPoint& tracked);
  void readmit(TrackedPoint& tracked);
  void decide(TrackedPoint& tracked);
  model::Existence tell(const model::MapUpdate& update);
  void tell_new(model::Utime utime, model::Existence& existence) const;
  std::set<model::LandmarkId> ids_to_tell();

  TrackerParameters parameters_;
  existence::ExistenceModel model_;
  LandmarkPlaces places_;
  MappingNeed need_;
  std::map<model::LandmarkId, TrackedPoint> points_;
  std::vector<Birth> births_;
  BirthCounts births_so_far_;
  existence::PassHistories histories_;      ///< Of all landmarks but those that changed since:
  std::vector<model::LandmarkId> changed_;  ///< since the last sum, and perhaps gone.
  std::vector<model::LandmarkId> due_;      ///< Whose states are, likewise.
  std::uint64_t learned_times_ = 0;
  std::vector<model::LandmarkId> touched_;  ///< Since the last message.
  TrackerCounters counters_;
  std::optional<Eigen::Vector2d> last_m_;  ///< Of the vehicle, frame map.
  model::Utime utime_ = 0;                 ///< Of the last keyframe.
  std::uint32_t map_id_ = 1;               ///< Likewise.
  std::uint32_t unused_ = 0;
  double along_m_ = 0.0;
  double pass_began_m_ = 0.0;
  double learned_m_ = 0.0;
  model::LandmarkId repeated_ = 0;  ///< The last one that was told again.
  bool wants_map_ = false;
  bool begins_drive_ = false;  ///< The next keyframe is the first one with these landmarks.
};

}  // namespace understory::existence_tracker
