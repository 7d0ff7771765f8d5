// How well a map and a trajectory agree with what is known of a recorded drive: satellite fixes and
// curated observations of trees.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/gnss.hpp"
#include "common/model/map.hpp"

namespace understory::eval::metrics {

/// A pose with its time; the frame is the user's.
struct StampedPose {
  model::Utime utime = 0;
  geometry::SE2 pose;
};

/// Whether the update has a pose of its keyframe in the map: it started the map or updated it.
bool localised(const model::MapUpdate& update);

/// The pose at a time, between the poses before and after; none outside of the trajectory. The
/// trajectory is in order of time.
std::optional<geometry::SE2> pose_at(std::span<const StampedPose> trajectory, model::Utime utime);

/// A pose for every stamp of `dead_reckoned` from the first of `known` on: dead reckoning from the
/// known pose before, with the error that shows at the next one spread over the time between.
std::vector<StampedPose> fill_between(std::span<const StampedPose> known,
                                      std::span<const StampedPose> dead_reckoned);

/// Distances between satellite fixes and a trajectory.
struct FixErrors {
  geometry::SE2
      world_T_map;  ///< Best rigid alignment of the poses at the fixes' times; frame east, north.
  std::vector<double> at_time_m;  ///< Of each fix, from the pose at its time.
  std::vector<double> to_path_m;  ///< From the nearest point of the path.
  double at_time_median_m = 0.0;
  double at_time_p90_m = 0.0;
  double to_path_median_m = 0.0;
  double to_path_p90_m = 0.0;
};

/// Errors of the antenna's place after one rigid alignment; it is at `antenna_m` of the vehicle.
/// Fixes outside of the trajectory's time are left out.
FixErrors against_fixes(std::span<const StampedPose> trajectory,
                        std::span<const model::GnssFix> fixes,
                        const Eigen::Vector2d& antenna_m = Eigen::Vector2d::Zero());

/// An observation of a tree whose identity is given.
struct CuratedObservation {
  model::Utime utime = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< Frame `vehicle`.
  int tree = 0;
};

/// Reads "t_s, range_m, bearing_rad_from_right, tree_id" with a heading. Throws DataError.
std::vector<CuratedObservation> read_curated_observations(const std::filesystem::path& file);

/// A curated tree and what the map has of it.
struct CuratedTree {
  int id = 0;
  std::size_t observations = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< Frame `map`.
  double spread_m = 0.0;           ///< RMS distance of its observations, placed by the trajectory.
  model::LandmarkId landmark = 0;  ///< The map's landmark for it; 0 = none.
  double distance_m = 0.0;         ///< To that landmark.
  std::size_t doubles = 0;         ///< Further landmarks at this tree that belong to no other tree.
};

/// How well the map agrees with the curated trees.
struct TreeScore {
  std::vector<CuratedTree> trees;
  std::size_t well_seen = 0;  ///< Trees observed at least `min_observations` times; of these:
  std::size_t found = 0;
  std::size_t doubled = 0;
  std::size_t landmarks_elsewhere = 0;  ///< Landmarks that belong to no curated tree.
  double median_spread_m = 0.0;
  double median_distance_m = 0.0;
};

/// Pairs trees and landmarks one to one, nearest first, up to `radius_m` apart.
TreeScore against_trees(std::span<const StampedPose> trajectory,
                        std::span<const CuratedObservation> observations,
                        std::span<const model::MapLandmark> landmarks, double radius_m = 1.0,
                        std::size_t min_observations = 20);

}  // namespace understory::eval::metrics
