// How well a recorded run agrees with the ground truth recorded beside it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/geometry/trajectory_error.hpp"
#include "common/io/lcm_log.hpp"
#include "common/model/held_map.hpp"
#include "common/model/map.hpp"
#include "common/model/slam_output.hpp"
#include "understory/health_t.hpp"
#include "understory/truth_landmarks_t.hpp"

namespace understory::cli {

/// A pose estimate beside the truth of the same instant, frame world.
struct ComparedPose {
  model::Utime utime = 0;
  geometry::SE2 world_T_vehicle;
  geometry::SE2 true_world_T_vehicle;
  /// Of the pose in its map: tangent order x, y, theta [m, rad]; zero where none is stated.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::uint32_t map_id = 1;

  /// Distance between the two positions.
  double position_error_m() const;
  /// Absolute difference of the headings.
  double heading_error_rad() const;
};

/// Where a map's frame is tied to the world, in order of preference.
enum class MapTie {
  kFirstMap,       ///< At the update that started the map.
  kFirstKeyframe,  ///< At the oldest keyframe of the last MAP: the recorder missed that update.
  kFirstUpdate,    ///< At the first update recorded: its own error is in every other one.
};
/// In words, for the table.
const char* to_string(MapTie tie);

/// The errors of one run.
struct DriveAccuracy {
  std::vector<ComparedPose> live;  ///< Every localised pose of SLAM_POSE.
  /// Of the last MAP, later ones as published. Those that were handed over in a submap have no
  /// covariance: theirs is relative to the submap.
  std::vector<ComparedPose> keyframes;
  std::vector<Eigen::Vector2d> landmarks_m;       ///< By MAP and MAP_DELTA, frame world.
  std::vector<Eigen::Vector2d> true_landmarks_m;  ///< Frame world.
  std::vector<double> landmark_errors_m;          ///< To the nearest true one.
  std::uint64_t scans = 0;                        ///< Of LANDMARKS in the log.
  std::map<model::MapUpdateStatus, std::uint64_t> updates;
  std::map<std::string, health_t> last_health;  ///< By process.
  std::uint64_t log_lost = 0;                   ///< LANDMARKS missing in the log itself.
  MapTie tied_at = MapTie::kFirstMap;
};

/// Collects a log's events. The map's frame is tied to the world at the base of the first keyframe,
/// or at the first instant of the map that was recorded with its truth: nothing is aligned, so an
/// error in that heading counts. Where the mapper began another map, each map is tied by itself.
class DriveAccuracyCollector {
 public:
  /// Takes one event, in the order of the log; channels that do not matter are passed over.
  void add(const io::LogEvent& event);
  /// None when the log has no ground truth at any instant of the map.
  std::optional<DriveAccuracy> finish() const;

 private:
  void add_landmarks_event(const io::LogEvent& event);
  void add_update(const model::MapUpdate& update);
  /// The true pose at `utime`, interpolated where it was recorded at other instants.
  std::optional<geometry::SE2> truth_at(model::Utime utime) const;
  /// world_T_map at the best instant there is, and which; none where the log holds none.
  std::optional<std::pair<geometry::SE2, MapTie>> tie(std::uint32_t map_id) const;
  std::optional<ComparedPose> compare(model::Utime utime,
                                      const geometry::SE2WithCovariance& map_T_vehicle,
                                      const geometry::SE2& world_T_map, std::uint32_t map_id) const;
  std::vector<ComparedPose> compared_keyframes(const model::WholeMap& whole,
                                               const geometry::SE2& world_T_map) const;

  std::map<model::Utime, geometry::SE2> truth_;
  std::vector<model::SlamPose> poses_;
  std::map<std::uint32_t, model::MapUpdate> first_;  ///< Of each map, that started it.
  std::vector<model::MapUpdate> updates_;  ///< Localised ones of the last map, in order of the log.
  std::uint32_t map_id_ = 1;               ///< Of the last update.
  model::HeldMap map_;
  truth_landmarks_t true_landmarks_{};
  std::optional<std::int64_t> last_scan_;
  DriveAccuracy counted_;
};

double mean(const std::vector<double>& values);     ///< 0 of none.
double maximum(const std::vector<double>& values);  ///< 0 of none.
double rms(const std::vector<double>& values);      ///< 0 of none.
/// For the measures of common/geometry/trajectory_error.
std::vector<geometry::PosePair> pairs_of(const std::vector<ComparedPose>& poses);
/// NEES of each pose that states a covariance: its error in the map, whose frame is held at the
/// tie, by that covariance. The truth counts as exact.
std::vector<double> nees_of(const std::vector<ComparedPose>& poses);
/// The position error of each pose.
std::vector<double> position_errors_m(const std::vector<ComparedPose>& poses);

}  // namespace understory::cli
