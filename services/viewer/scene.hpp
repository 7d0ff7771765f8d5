// What the viewer knows of one run, as a page shows it.
#pragma once

#include <array>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/model/existence.hpp"
#include "common/model/planar_scan.hpp"
#include "common/model/point_sweep.hpp"
#include "common/model/slam_output.hpp"
#include "common/model/submap.hpp"
#include "services/viewer/keyframe_path.hpp"
#include "services/viewer/landmark_table.hpp"
#include "services/viewer/process_board.hpp"
#include "services/viewer/submap_places.hpp"
#include "services/viewer/track.hpp"
#include "services/viewer/truth_alignment.hpp"
#include "understory/log_t.hpp"

namespace understory::viewer {

/// A part of the scene and the number of its latest change; 0 = there is none yet.
template <class T>
struct Part {
  T value{};
  Change change = 0;
};

/// What a driver must know of the pose.
struct Verdict {
  /// The worse the later, but for kWaiting.
  enum class State : std::uint8_t { kWaiting, kOk, kUnsure, kLost, kSilent };
  State state = State::kWaiting;
  std::string text = "no pose yet";
  std::int64_t since_utime = 0;  ///< [us] since when it is so.
};

/// As pages and scripts have it: waiting, ok, unsure, lost, silent.
const char* state_name(Verdict::State state);

/// What the sensor sees now.
struct SceneScan {
  std::int64_t utime = 0;
  std::vector<std::array<float, 3>> points_m;  ///< Frame vehicle.
  std::vector<model::Detection> detections;    ///< Frame vehicle_level.
};

/// What became of the latest keyframe.
struct SceneMatches {
  model::MapUpdate update;
};

/// A loop closure and what became of it.
struct SceneClosure {
  model::LoopClosure closure;
  std::string status = "sent";
  std::string reason;
};

/// 97.5 % of chi^2 with the 3 degrees of freedom of a pose: upper line of the plot of NEES.
inline constexpr double kNeesBound = 9.35;

/// Figures that are plotted; none = unknown.
struct SceneNumbers {
  std::optional<double> error_m;    ///< To ground truth.
  std::optional<double> error_rad;  ///< Likewise.
  std::optional<double> nees;       ///< Over 3 degrees of freedom.
  /// NEES says that the covariance is too small, and has not been within its bounds since.
  bool is_too_sure = false;
  std::optional<double> nis;
  std::uint32_t nis_dof = 0;
  std::optional<double> rate_hz;        ///< Of poses.
  std::optional<double> latency_ms;     ///< From the stamp to the arrival of the pose.
  std::optional<double> missing_share;  ///< Of the map, on the last metres; see model::Existence.
  std::optional<double> new_share;      ///< Likewise.
  bool is_mapping_needed = false;
};

/// Takes messages in the order in which they came, with the wall clock at which each came [us]
/// (for a log: of its events). Memory is bounded by the map and by the limits of its parts; a
/// message costs what it changes.
class Scene {
 public:
  Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  // The map and the pose.
  void take(const model::SlamPose& pose, std::int64_t wall_us);
  void take(const model::MapUpdate& update);
  void take(const model::WholeMap& map);
  void take(const model::MapDelta& delta);
  void take(const model::Existence& existence);
  void take(const model::Submap& submap);
  void take(const model::MapCorrection& correction);
  void take(const model::LoopClosure& closure);
  void take(const model::LoopResult& result);
  // What the sensor sees.
  void take(const model::LandmarkScan& scan, std::int64_t wall_us);
  void take(const model::PlanarScan& scan, const geometry::SE2& vehicle_T_sensor);
  void take(const model::PointSweep& part);
  /// A stamp of a fast sensor: from its age follows how old others are.
  void take_stamp(model::Utime utime, std::int64_t wall_us);
  // Ground truth, processes, messages for people.
  void take_truth(model::Utime utime, const geometry::SE2& world_T_vehicle);
  void take(const health_t& health, std::int64_t wall_us) { processes_.take(health, wall_us); }
  void take(const log_t& line);
  /// Landmarks of a stored map, without a mapper.
  void take_stored(std::span<const model::MapLandmark> landmarks,
                   std::span<const model::LandmarkExistence> existence,
                   std::span<const model::KeyframePose> keyframes);
  /// Whether the whole map should be asked for: none was heard, or changes were missed.
  bool wants_map() const { return wants_map_; }
  /// Time passes: what is silent.
  void look(std::int64_t wall_us);
  /// As before the first message; readers are told.
  void reset();

  // For the frames.
  const LandmarkTable& landmarks() const { return landmarks_; }
  const Track& driven() const { return driven_; }
  const Track& keyframes() const { return keyframes_.track(); }
  const Track& truth() const { return truth_; }
  const Part<std::optional<model::SlamPose>>& pose() const { return pose_; }
  const Part<std::optional<geometry::SE2>>& true_pose() const { return true_pose_; }
  const Part<Verdict>& verdict() const { return verdict_; }
  const Part<SceneScan>& scan() const { return scan_; }
  const Part<SceneMatches>& matches() const { return matches_; }
  const SubmapPlaces& submaps() const { return submaps_; }
  Change submaps_change() const { return submaps_change_; }
  const std::map<std::uint64_t, SceneClosure>& closures() const { return closures_; }
  Change closures_change() const { return closures_change_; }
  const Part<SceneNumbers>& numbers() const { return numbers_; }
  const ProcessBoard& processes() const { return processes_; }
  ProcessBoard& processes() { return processes_; }
  const std::deque<Part<log_t>>& log() const { return log_; }
  /// Where an end of a closure is; none where it is not known.
  std::optional<Eigen::Vector2d> place_of(const model::LoopEnd& end) const;

  /// Newest stamp of what was taken, -1 before the first.
  model::Utime utime() const { return utime_; }
  /// Wall clock of the newest message [us].
  std::int64_t newest_wall_us() const { return newest_wall_us_; }
  /// Number of the latest change.
  Change change() const { return change_; }
  /// Number of the latest reset.
  Change reset_change() const { return reset_change_; }

 private:
  void start_map(std::uint32_t map_id);
  void set_verdict(Verdict::State state, std::string text, model::Utime utime);
  void draw(const model::SlamPose& pose);
  void judge(const model::SlamPose& pose);
  std::optional<geometry::SE2> truth_at(model::Utime utime) const;
  void tie_to_truth(const model::MapUpdate& first);
  void compare_with_truth(const model::SlamPose& pose);
  void move_keyframes(const model::MapCorrection& correction);
  void note_time(model::Utime utime, std::int64_t wall_us);
  template <class T>
  T& changed(Part<T>& part) {
    part.change = ++change_;
    return part.value;
  }

  Change change_ = 0;
  Change reset_change_ = 0;
  std::uint32_t map_id_ = 0;
  std::uint64_t map_version_ = 0;
  bool wants_map_ = true;
  LandmarkTable landmarks_{change_};
  Track driven_{change_};
  KeyframePath keyframes_{change_};
  Track truth_{change_};
  Part<std::optional<model::SlamPose>> pose_;
  Part<std::optional<geometry::SE2>> true_pose_;
  Part<Verdict> verdict_;
  Part<SceneScan> scan_;
  std::uint64_t revolution_ = 0;  ///< Of the sweep in scan_.
  Part<SceneMatches> matches_;
  SubmapPlaces submaps_;
  std::map<model::SubmapId, std::vector<model::KeyframePose>> handed_over_keyframes_;
  Change submaps_change_ = 0;
  std::map<std::uint64_t, SceneClosure> closures_;
  Change closures_change_ = 0;
  Part<SceneNumbers> numbers_;
  ProcessBoard processes_{change_};
  std::deque<Part<log_t>> log_;

  model::Utime utime_ = -1;
  std::int64_t newest_wall_us_ = 0;
  std::int64_t pose_wall_us_ = 0;
  std::deque<std::int64_t> pose_times_us_;
  /// Least difference of wall clock to stamp in this period and the one before [us].
  std::array<std::optional<std::int64_t>, 2> least_age_us_;
  std::int64_t age_period_us_ = 0;
  /// By the keyframe that began the map, whose pose defines its frame; where it is not known, by
  /// the alignment of all poses.
  std::optional<geometry::SE2> world_T_map_;
  TruthAlignment alignment_;
  geometry::SE2 drawn_world_T_map_;
  std::vector<std::pair<model::Utime, geometry::SE2>> world_truth_;
};

}  // namespace understory::viewer
