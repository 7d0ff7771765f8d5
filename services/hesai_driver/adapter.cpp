#include "services/hesai_driver/adapter.hpp"

#include <memory>

#include "services/hesai_driver/adapter_parameters.hpp"
#include "services/lidar_driver/driver_adapter.hpp"
#include "services/lidar_driver/packet_stage.hpp"

namespace understory::hesai_driver {
namespace {

struct HesaiFamily {
  using Parameters = HesaiDriverParameters;
  using Stage = lidar_driver::PacketStage;

  static void describe(Parameters& parameters, bus::ParameterTable& table) {
    hesai_driver::describe(parameters, table);
  }
  static lidar_driver::DriverSettings settings(const Parameters& p,
                                               const lidar_driver::DriverChannels& channels) {
    return {p.network, {{"data", p.ports.data, channels.sweep}}, p.range.silence_s, false, false};
  }
  static Stage make_stage(const Parameters& p) {
    return lidar_driver::make_stage({p.sensor.model, {}, p.sensor.angle_file, p.range.max_range_m},
                                    "sensor.angle_file", p.time);
  }
};

}  // namespace

bus::Service hesai_driver_service(const HesaiDriverChannels& channels) {
  return {"hesai_driver", channels.all, [channels] {
            return std::make_unique<lidar_driver::DriverAdapter<HesaiFamily>>(
                lidar_driver::DriverChannels{channels.raw_sweep, "", ""});
          }};
}

}  // namespace understory::hesai_driver
