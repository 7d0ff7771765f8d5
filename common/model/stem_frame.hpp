// A drive as frames of detected stems, as forest inventories are recorded.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/landmarks.hpp"

namespace understory::model {

/// One detected stem, frame `sensor`.
struct Stem {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< z = 0 where it is not known.
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();        ///< Of unit length; zero where not known.
  double diameter_m = 0.0;                               ///< At breast height; 0 where not known.
  double score = 0.0;  ///< The detector's own, without a unit; 0 where there is none.
};

/// All stems of one moment, and where the sensor was.
struct StemFrame {
  Utime utime = 0;
  std::int64_t number = 0;  ///< Of its file.
  /// The truth of a reference system. Its roll and pitch are also what levels the stems.
  Eigen::Isometry3d world_T_sensor = Eigen::Isometry3d::Identity();
  std::vector<Stem> stems;
};

/// Pose of `vehicle_level` in the plane: where the sensor is, and its heading.
geometry::SE2 level_pose(const StemFrame& frame);

/// Rotation from `sensor` to `vehicle_level`: roll and pitch of the frame, without its heading.
Eigen::Matrix3d level_R_sensor(const StemFrame& frame);

/// The stems as a scan in `vehicle_level`, each with standard deviation `sigma_m` per axis [m], >
/// 0; in the order of the frame. `max_range_m` states the field of view, all around.
LandmarkScan level_scan(const StemFrame& frame, double sigma_m, double max_range_m);

}  // namespace understory::model
