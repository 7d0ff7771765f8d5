// A mapper's output in a log, and the formats in which other tools read it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/io/lcm_log.hpp"
#include "common/model/existence.hpp"
#include "common/model/held_map.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/slam_output.hpp"

namespace understory::cli {

/// What was said of landmarks' existence, by id.
using ExistenceById = std::map<model::LandmarkId, model::LandmarkExistence>;

/// The output of the last mapper run in a log.
struct SlamResults {
  std::vector<model::SlamPose> poses;  ///< As published live, localised ones.
  model::HeldMap map;                  ///< By MAP and all that came after it.
  std::vector<std::pair<model::Utime, geometry::SE2>>
      truth;                                           ///< world_T_vehicle, where the log has it.
  std::map<std::uint64_t, model::Keyframe> keyframes;  ///< By number.
  std::vector<model::MapUpdate> updates;               ///< Those that were fused.
  ExistenceById existence;                             ///< As told last.

  /// Takes one event; channels that do not matter are passed over.
  void add(const io::LogEvent& event);
};

/// "time x y z qx qy qz qw", one pose a line [s, m]: what evo and the TUM tools read.
std::string to_tum(const std::vector<std::pair<model::Utime, geometry::SE2>>& poses);
/// The three rows of each pose's 4 x 4 matrix on one line [m]: what evo and the KITTI tools read.
/// No times; axes as the vehicle has them (x forward, y left, z up), where KITTI's own are a
/// camera's.
std::string to_kitti(const std::vector<std::pair<model::Utime, geometry::SE2>>& poses);
/// Live poses whose true pose the log has, and these true poses, in the same order: KITTI's format
/// pairs lines. All live poses and no true ones where the log has no truth.
struct PairedTrajectories {
  std::vector<std::pair<model::Utime, geometry::SE2>> live;
  std::vector<std::pair<model::Utime, geometry::SE2>> truth;
};
/// Cost: O(n log n).
PairedTrajectories paired_trajectories(const SlamResults& results);
/// map_T_vehicle as published live, by stamp.
std::vector<std::pair<model::Utime, geometry::SE2>> live_trajectory(const SlamResults& results);
/// map_T_base of the map's keyframes, by stamp.
std::vector<std::pair<model::Utime, geometry::SE2>> keyframe_trajectory(const model::WholeMap& map);

/// One landmark a line, with a heading: id, position, covariance, radius, times seen, probability
/// that it exists and whether it is in use (1 or 0); the last two are empty where nothing was said.
std::string landmarks_csv(const model::WholeMap& map, const ExistenceById& existence);
/// One keyframe a line, with a heading: number, stamp, pose, covariance.
std::string keyframes_csv(const model::WholeMap& map);

/// The map as a graph for g2o: VERTEX_SE2 for keyframes (their number), VERTEX_XY for landmarks
/// (numbered behind them, in order of id), EDGE_SE2_XY for every association. An edge's information
/// is of the landmark in the frame of the keyframe's base; the format cannot hold the correlation
/// of a keyframe's edges through the base's own uncertainty.
std::string to_g2o(const SlamResults& results);

}  // namespace understory::cli
