#include "services/livox_driver/adapter.hpp"

#include <memory>

#include "services/lidar_driver/driver_adapter.hpp"
#include "services/lidar_driver/packet_stage.hpp"
#include "services/livox_driver/adapter_parameters.hpp"

namespace understory::livox_driver {
namespace {

struct LivoxFamily {
  using Parameters = LivoxDriverParameters;
  using Stage = lidar_driver::PacketStage;

  static void describe(Parameters& parameters, bus::ParameterTable& table) {
    livox_driver::describe(parameters, table);
  }
  static lidar_driver::DriverSettings settings(const Parameters& p,
                                               const lidar_driver::DriverChannels& channels) {
    return {p.network,
            {{"points", p.ports.points, channels.sweep}, {"imu", p.ports.imu, channels.imu}},
            p.range.silence_s,
            p.imu.is_published,
            false};
  }
  static Stage make_stage(const Parameters& p) {
    return lidar_driver::make_stage(
        {p.sensor.model, {}, {}, p.range.max_range_m, p.sensor.period_s}, "", p.time);
  }
};

}  // namespace

bus::Service livox_driver_service(const LivoxDriverChannels& channels) {
  return {"livox_driver", channels.all, [channels] {
            return std::make_unique<lidar_driver::DriverAdapter<LivoxFamily>>(
                lidar_driver::DriverChannels{channels.raw_sweep, channels.raw_imu, ""});
          }};
}

}  // namespace understory::livox_driver
