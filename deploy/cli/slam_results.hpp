// A mapper's output in a log, and its conversion to formats of other tools.
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

/// Existence of landmarks by id.
using ExistenceById = std::map<model::LandmarkId, model::LandmarkExistence>;

/// The output of the last mapper run in a log.
struct SlamResults {
  std::vector<model::SlamPose> poses;  ///< Localised poses as published live.
  model::HeldMap map;                  ///< From MAP and all later messages.
  std::vector<std::pair<model::Utime, geometry::SE2>>
      truth;                                           ///< world_T_vehicle, if the log has it.
  std::map<std::uint64_t, model::Keyframe> keyframes;  ///< Keyframes by number.
  std::vector<model::MapUpdate> updates;               ///< Updates of fused keyframes.
  ExistenceById existence;                             ///< Latest values.

  /// Takes one event; unused channels are skipped.
  void add(const io::LogEvent& event);
};

/// "time x y z qx qy qz qw", one pose per line [s, m], for evo and the TUM tools.
std::string to_tum(const std::vector<std::pair<model::Utime, geometry::SE2>>& poses);
/// The three rows of each pose's 4 x 4 matrix on one line [m]: for evo and the KITTI tools. Without
/// times; axes of the vehicle (x forward, y left, z up), whereas KITTI's own are a camera's.
std::string to_kitti(const std::vector<std::pair<model::Utime, geometry::SE2>>& poses);
/// Live poses with a true pose in the log, and these true poses, in the same order, because KITTI's
/// format pairs lines. Without truth in the log: all live poses and no true ones.
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

/// One landmark per line, with a heading: id, position, covariance, radius, times seen, probability
/// of existence, and whether it is in use (1 or 0); the last two are empty where unknown.
std::string landmarks_csv(const model::WholeMap& map, const ExistenceById& existence);
/// One keyframe per line, with a heading: number, stamp, pose, covariance.
std::string keyframes_csv(const model::WholeMap& map);

/// The map as a graph for g2o: VERTEX_SE2 for keyframes (their number), VERTEX_XY for landmarks
/// (numbered after them, in order of id), EDGE_SE2_XY for every association. An edge's information
/// refers to the landmark in the frame of the keyframe's base; the format has no correlation of a
/// keyframe's edges through the base's own uncertainty.
std::string to_g2o(const SlamResults& results);

}  // namespace understory::cli
