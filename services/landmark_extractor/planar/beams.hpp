// The beams of one plane, each with the laser's position at its time.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "common/model/planar_scan.hpp"
#include "common/model/point_sweep.hpp"
#include "services/landmark_extractor/points/spin_fit.hpp"

namespace understory::landmark_extractor::planar {

/// Sigma of a landmark's height [m]: one plane does not measure it.
inline constexpr double kHeightSigma_m = 0.5;

/// One beam in the plan. Beams of a scan are ordered from right to left.
struct Beam {
  Eigen::Vector2d origin_m = Eigen::Vector2d::Zero();  ///< Of the laser.
  Eigen::Vector2d point_m = Eigen::Vector2d::Zero();   ///< Of the return, if there is one.
  double z_m = 0.0;                                    ///< Likewise.
  double time_s = 0.0;                                 ///< Likewise, from utime.
  double bearing_rad = 0.0;  ///< From the origin; grows from beam to beam, also beyond pi.
  double range_m = 0.0;      ///< In the plan; 0 = no return.

  bool is_return() const { return range_m > 0.0; }
};

/// A scan. Frame `vehicle_level` if the attitude is known, else `vehicle`.
struct Beams {
  std::vector<Beam> beams;
  double step_rad = 0.0;                               ///< From beam to beam; 0 = unknown.
  double max_range_m = 0.0;                            ///< Of the laser.
  Eigen::Vector3d sensor_m = Eigen::Vector3d::Zero();  ///< Of the laser at utime.
};

/// A scan taken in one instant. Precondition: its step is positive.
Beams beams_of(const model::PlanarScan& scan);
/// A de-skewed sweep of one ring: a gap in the returns gets a beam without return. `spin`: motion
/// of the laser. Beams before the first return are unknown.
Beams beams_of(const model::PointSweep& sweep, const points::Spin& spin);

}  // namespace understory::landmark_extractor::planar
