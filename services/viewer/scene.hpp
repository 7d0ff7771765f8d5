// The state of one run for display on a page.
#pragma once

#include <deque>
#include <map>
#include <optional>

#include "services/viewer/known_truth.hpp"
#include "services/viewer/message_ages.hpp"
#include "services/viewer/part.hpp"
#include "services/viewer/process_board.hpp"
#include "services/viewer/scene_numbers.hpp"
#include "services/viewer/shown_closures.hpp"
#include "services/viewer/shown_map.hpp"
#include "services/viewer/shown_pose.hpp"
#include "services/viewer/shown_scan.hpp"
#include "understory/log_t.hpp"

namespace understory::viewer {

/// Result of the latest keyframe.
struct SceneMatches {
  model::MapUpdate update;
};

/// Takes messages in order of reception, with the wall clock of each [us] (for a log: of its
/// events). Memory is bounded by the map and by the limits of its parts; the cost of a message
/// depends on what it changes.
class Scene {
 public:
  Scene() = default;
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  // The map and the pose.
  void take(const model::SlamPose& pose, std::int64_t wall_us);
  void take(const model::MapUpdate& update);
  void take(const model::WholeMap& map);
  void take(const model::MapDelta& delta);
  void take(const model::Existence& existence);
  void take(const model::Submap& submap) { map_.take(submap); }
  void take(const model::MapCorrection& correction) { map_.take(correction); }
  void take(const model::LoopClosure& closure) { closures_.take(closure); }
  void take(const model::LoopResult& result) { closures_.take(result); }
  // Data of the sensors.
  void take(const model::LandmarkScan& scan, std::int64_t wall_us);
  void take(const model::PlanarScan& scan, const geometry::SE2& vehicle_T_sensor) {
    scan_.take(scan, vehicle_T_sensor);
  }
  void take(const model::PointSweep& part) { scan_.take(part); }
  /// A stamp of a fast sensor: the ages of other messages are relative to it.
  void take_stamp(model::Utime utime, std::int64_t wall_us) { ages_.note_stamp(utime, wall_us); }
  // Ground truth, processes, messages for people.
  void take_truth(model::Utime utime, const geometry::SE2& world_T_vehicle) {
    truth_.take(utime, world_T_vehicle);
  }
  void take(const health_t& health, std::int64_t wall_us) { processes_.take(health, wall_us); }
  void take(const log_t& line);
  /// Landmarks of a stored map, without a mapper.
  void take_stored(std::span<const model::MapLandmark> landmarks,
                   std::span<const model::LandmarkExistence> existence,
                   std::span<const model::KeyframePose> keyframes) {
    map_.take_stored(landmarks, existence, keyframes);
  }
  /// Whether the whole map must be requested: none was received, or changes were missed.
  bool wants_map() const { return map_.wants_whole(); }
  /// Detects silence at this time.
  void look(std::int64_t wall_us);
  /// Resets to the state before the first message; readers are notified.
  void reset();

  // For the frames.
  const LandmarkTable& landmarks() const { return map_.landmarks(); }
  const Track& driven() const { return pose_.driven(); }
  const Track& keyframes() const { return map_.keyframes(); }
  const Track& truth() const { return truth_.track(); }
  const Part<std::optional<model::SlamPose>>& pose() const { return pose_.pose(); }
  const Part<std::optional<geometry::SE2>>& true_pose() const { return truth_.pose(); }
  const Part<Verdict>& verdict() const { return pose_.verdict(); }
  const Part<SceneScan>& scan() const { return scan_.part(); }
  const Part<SceneMatches>& matches() const { return matches_; }
  const SubmapPlaces& submaps() const { return map_.submaps(); }
  Change submaps_change() const { return map_.submaps_change(); }
  const std::map<std::uint64_t, SceneClosure>& closures() const { return closures_.by_id(); }
  Change closures_change() const { return closures_.change(); }
  const Part<SceneNumbers>& numbers() const { return numbers_; }
  const ProcessBoard& processes() const { return processes_; }
  ProcessBoard& processes() { return processes_; }
  const std::deque<Part<log_t>>& log() const { return log_; }
  /// Position of an end of a closure; none if it is unknown.
  std::optional<Eigen::Vector2d> place_of(const model::LoopEnd& end) const {
    return map_.place_of(end);
  }

  /// Newest stamp received, -1 before the first.
  model::Utime utime() const { return ages_.utime(); }
  /// Wall clock of the newest message [us].
  std::int64_t newest_wall_us() const { return ages_.newest_wall_us(); }
  /// Number of the latest change.
  Change change() const { return change_; }
  /// Number of the latest reset.
  Change reset_change() const { return reset_change_; }

 private:
  void start_map(std::uint32_t map_id);
  void compare_with_truth(const model::SlamPose& pose);
  template <class T>
  T& changed(Part<T>& part) {
    return part.changed(change_);
  }

  Change change_ = 0;
  Change reset_change_ = 0;
  ShownMap map_{change_};
  ShownPose pose_{change_};
  KnownTruth truth_{change_};
  ShownScan scan_{change_};
  Part<SceneMatches> matches_;
  ShownClosures closures_{change_};
  Part<SceneNumbers> numbers_;
  ProcessBoard processes_{change_};
  std::deque<Part<log_t>> log_;
  MessageAges ages_;
};

}  // namespace understory::viewer
