// Records of an OXTS inertial and satellite navigation system, in the format of KITTI.
#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/gnss.hpp"
#include "common/model/imu.hpp"

namespace understory::io {

/// One record of 30 values; frame of the unit: x forward, y left, z up.
struct OxtsRecord {
  model::Utime utime = 0;
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double altitude_m = 0.0;
  Eigen::Vector3d roll_pitch_yaw_rad = Eigen::Vector3d::Zero();  ///< Yaw 0 = east, left positive.
  Eigen::Vector2d east_north_velocity_mps = Eigen::Vector2d::Zero();
  double forward_velocity_mps = 0.0;
  Eigen::Vector3d specific_force_mps2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_rate_rad_s = Eigen::Vector3d::Zero();
  double position_sigma_m = 0.0;
  double velocity_sigma_mps = 0.0;
};

/// One record from its line of 30 numbers; `source` names the text in errors. The stamp stays 0.
/// Throws DataError.
OxtsRecord parse_oxts(std::string_view text, std::string_view source);

/// Metres east and north of an origin (WGS 84, good for a drive of some tens of kilometres).
class LocalPlane {
 public:
  /// A plane that touches the earth at this origin.
  LocalPlane(double latitude_deg, double longitude_deg);
  /// Metres east and north of the origin.
  Eigen::Vector2d east_north_m(double latitude_deg, double longitude_deg) const;

 private:
  double latitude_deg_;
  double longitude_deg_;
  double north_per_deg_m_;
  double east_per_deg_m_;
};

}  // namespace understory::io
