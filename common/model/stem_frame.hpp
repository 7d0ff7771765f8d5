// A drive as frames of detected stems, as in forest inventories.
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
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();        ///< Unit vector; zero where unknown.
  double diameter_m = 0.0;                               ///< At breast height; 0 where not known.
  double score = 0.0;  ///< The detector's own score, without a unit; 0 = none.
};

/// All stems of one moment, and the pose of the sensor.
struct StemFrame {
  Utime utime = 0;
  std::int64_t number = 0;  ///< Number of its file.
  /// Truth from a reference system. Its roll and pitch also level the stems.
  Eigen::Isometry3d world_T_sensor = Eigen::Isometry3d::Identity();
  std::vector<Stem> stems;
};

/// Pose of `vehicle_level` in the plane: position and heading of the sensor.
geometry::SE2 level_pose(const StemFrame& frame);

/// Rotation from `sensor` to `vehicle_level`: roll and pitch of the frame, without its heading.
Eigen::Matrix3d level_R_sensor(const StemFrame& frame);

/// The stems as a scan in `vehicle_level`, each with standard deviation `sigma_m` per axis [m], >
/// 0; in the order of the frame. `max_range_m` states the field of view, all around.
LandmarkScan level_scan(const StemFrame& frame, double sigma_m, double max_range_m);

}  // namespace understory::model
