// The landmarks detected in one sweep by the extractor or the simulator.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <numbers>
#include <vector>

namespace understory::model {

/// Microseconds since the epoch of the recording: the time of the measurement.
using Utime = std::int64_t;

/// A tree trunk (a circle) or the corner of a house (a vertical edge).
enum class LandmarkKind : std::uint8_t { kTrunk = 0, kCorner = 1 };

/// One detected landmark.
struct Detection {
  /// Centre (trunk) or edge (corner), each 1.3 m above the ground, in `vehicle_level` [m].
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  /// Covariance of the position [m^2], frame `vehicle_level`.
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();
  /// Radius of a trunk [m]; 0 where unknown or a corner.
  double radius_m = 0.0;
  LandmarkKind kind = LandmarkKind::kTrunk;
  /// For a corner: direction of the bisector, pointing out of the house, frame `vehicle_level`.
  double bearing_rad = 0.0;
  double bearing_sigma_rad = 0.0;  ///< Its standard deviation; 0 = none (a trunk).
};

/// The area in which the sensor can detect landmarks: a sector of a disc around the vehicle.
struct FieldOfView {
  double max_range_m = 0.0;  ///< In the plane.
  /// Direction of the sector's middle [rad], 0 = straight ahead, left positive.
  double bearing_rad = 0.0;
  /// Full width of the sector [rad]; 2 pi = all around.
  double width_rad = 2.0 * std::numbers::pi;

  /// True where a landmark at this position (frame `vehicle_level`) is in the sector.
  bool contains(const Eigen::Vector2d& position_in_vehicle_m) const;
};

/// Channel LANDMARKS: all detections of one sweep, frame `vehicle_level` at `utime`.
struct LandmarkScan {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  FieldOfView field_of_view;
  std::vector<Detection> detections;
};

}  // namespace understory::model
