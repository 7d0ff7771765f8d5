#include "sim/planar_laser.hpp"

#include <cmath>

#include "sim/hash_random.hpp"

namespace understory::sim {

PlanarLaser::PlanarLaser(const World& world, const PlanarLaserParameters& parameters,
                         std::uint64_t seed)
    : parameters_(parameters), seed_(mixed(seed, 0x91a2)), caster_(world) {}

SimulatedPlanarScan PlanarLaser::scan(const VehicleMotion& motion, std::uint64_t k,
                                      model::Utime utime_of_start) {
  const double begin_s = time_s(k);
  SimulatedPlanarScan result;
  result.scan.utime = utime_of_start + static_cast<model::Utime>(std::llround(begin_s * 1e6));
  result.scan.sequence = k;
  result.scan.first_bearing_rad = parameters_.first_bearing_rad;
  result.scan.bearing_step_rad = parameters_.bearing_step_rad;
  result.scan.max_range_m = parameters_.max_range_m;
  result.scan.beam_interval_s = parameters_.beam_interval_s();
  for (int beam = 0; beam < parameters_.beams; ++beam) {
    const double at_s = begin_s + beam * parameters_.beam_interval_s();
    const Eigen::Isometry3d world_T_sensor =
        motion.at(at_s).world_T_vehicle() * parameters_.vehicle_T_sensor;
    const double bearing = parameters_.first_bearing_rad + beam * parameters_.bearing_step_rad;
    const Eigen::Vector3d direction =
        world_T_sensor.linear() * Eigen::Vector3d(std::cos(bearing), std::sin(bearing), 0.0);
    const std::uint64_t luck = mixed(mixed(seed_, k), static_cast<std::uint64_t>(beam));
    RayHit hit;
    caster_.cast(world_T_sensor.translation(), {&direction, 1}, at_s, parameters_.max_range_m, luck,
                 {&hit, 1});
    const double range = hit.range_m + parameters_.range_sigma_m * normal_of(mixed(luck, 1));
    const bool is_return = hit.is_hit && uniform_of(mixed(luck, 2)) >= parameters_.drop_out &&
                           range > 0.0 && range < parameters_.max_range_m;

    result.scan.ranges_m.push_back(static_cast<float>(is_return ? range : parameters_.max_range_m));
    result.objects.push_back(hit.object);
    result.is_return.push_back(is_return ? 1 : 0);
  }

  return result;
}

}  // namespace understory::sim
