// A one-plane laser scanner.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "common/model/planar_scan.hpp"
#include "sim/ray_caster.hpp"
#include "sim/vehicle_motion.hpp"

namespace understory::sim {

/// Beams of the SICK LMS of Victoria Park, on a head that rotates while it scans: half a turn takes
/// 50 ms, in which a car at 5 m/s moves by 25 cm. The SICK's own mirror takes 13 ms for a turn.
struct PlanarLaserParameters {
  int beams = 361;  ///< From right to left.
  double first_bearing_rad = -0.5 * std::numbers::pi;
  double bearing_step_rad = std::numbers::pi / 360.0;
  double rate_hz = 10.0;
  double revolution_s = 0.1;  ///< For a full turn; 0 = all beams at one instant.
  double range_sigma_m = 0.02;
  double max_range_m = 80.0;
  double drop_out = 0.005;  ///< Share of returns lost by chance.
  Eigen::Isometry3d vehicle_T_sensor = Eigen::Isometry3d(Eigen::Translation3d(3.6, 0.0, 0.8));

  /// From beam to beam.
  double beam_interval_s() const {
    return revolution_s * std::abs(bearing_step_rad) / (2.0 * std::numbers::pi);
  }
  /// From the first beam to the last one.
  double scan_s() const { return beam_interval_s() * (beams - 1); }
};

/// A scan of the sensor, with the truth.
struct SimulatedPlanarScan {
  model::PlanarScan scan;         ///< Beams without a return have max_range_m.
  std::vector<ObjectId> objects;  ///< Per beam; the ground if there is no return.
  std::vector<std::uint8_t> is_return;
};

/// A one-plane laser in a world.
class PlanarLaser {
 public:
  /// `world` must outlive the sensor and must not change.
  PlanarLaser(const World& world, const PlanarLaserParameters& parameters, std::uint64_t seed);

  /// Time of the first beam of scan k in the drive.
  double time_s(std::uint64_t k) const { return static_cast<double>(k) / parameters_.rate_hz; }
  /// Time of its last beam.
  double end_s(std::uint64_t k) const { return time_s(k) + parameters_.scan_s(); }
  /// Scan number k, starting at time_s(k) of the drive. Does not depend on earlier calls.
  SimulatedPlanarScan scan(const VehicleMotion& motion, std::uint64_t k,
                           model::Utime utime_of_start = 0);

 private:
  PlanarLaserParameters parameters_;
  std::uint64_t seed_;
  RayCaster caster_;
};

}  // namespace understory::sim
