// A laser scanner with one plane.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <numbers>
#include <vector>

#include "common/model/planar_scan.hpp"
#include "sim/ray_caster.hpp"
#include "sim/vehicle_motion.hpp"

namespace understory::sim {

/// As the SICK LMS of Victoria Park, if a little faster. Its mirror takes 13 ms for a revolution,
/// in which the car moves by centimetres: a scan is taken at one instant.
struct PlanarLaserParameters {
  int beams = 361;  ///< From the right to the left.
  double first_bearing_rad = -0.5 * std::numbers::pi;
  double bearing_step_rad = std::numbers::pi / 360.0;
  double rate_hz = 10.0;
  double range_sigma_m = 0.02;
  double max_range_m = 80.0;
  double drop_out = 0.005;  ///< Share of returns lost by chance.
  Eigen::Isometry3d vehicle_T_sensor = Eigen::Isometry3d(Eigen::Translation3d(3.6, 0.0, 0.8));
};

/// A scan as the sensor gives it, with the truth.
struct SimulatedPlanarScan {
  model::PlanarScan scan;         ///< Beams without a return have max_range_m.
  std::vector<ObjectId> objects;  ///< Per beam; the ground's where there is no return.
  std::vector<std::uint8_t> is_return;
};

/// A one-plane laser in a world.
class PlanarLaser {
 public:
  /// `world` must outlive the sensor and stay as it is.
  PlanarLaser(const World& world, const PlanarLaserParameters& parameters, std::uint64_t seed);

  /// Time of scan k in the drive.
  double time_s(std::uint64_t k) const { return static_cast<double>(k) / parameters_.rate_hz; }
  /// Scan number k, at time_s(k) of the drive. Depends on nothing that was asked before.
  SimulatedPlanarScan scan(const VehicleMotion& motion, std::uint64_t k,
                           model::Utime utime_of_start = 0);

 private:
  PlanarLaserParameters parameters_;
  std::uint64_t seed_;
  RayCaster caster_;
};

}  // namespace understory::sim
