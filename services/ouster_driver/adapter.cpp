#include "services/ouster_driver/adapter.hpp"

#include <memory>

#include "services/lidar_driver/driver_adapter.hpp"
#include "services/lidar_driver/packet_stage.hpp"
#include "services/ouster_driver/adapter_parameters.hpp"

namespace understory::ouster_driver {
namespace {

struct OusterFamily {
  using Parameters = OusterDriverParameters;
  using Stage = lidar_driver::PacketStage;

  static void describe(Parameters& parameters, bus::ParameterTable& table) {
    ouster_driver::describe(parameters, table);
  }
  static lidar_driver::DriverSettings settings(const Parameters& p,
                                               const lidar_driver::DriverChannels& channels) {
    return {p.network,
            {{"lidar", p.ports.lidar, channels.sweep}, {"imu", p.ports.imu, channels.imu}},
            p.range.silence_s,
            p.imu.is_published,
            false};
  }
  static Stage make_stage(const Parameters& p) {
    if (p.sensor.metadata_file.empty())
      throw bus::ConfigurationError(
          {"sensor.metadata_file: an Ouster's packets do not say where its beams point"});
    return lidar_driver::make_stage({"ouster", {}, p.sensor.metadata_file, p.range.max_range_m},
                                    "sensor.metadata_file", p.time);
  }
};

}  // namespace

bus::Service ouster_driver_service(const OusterDriverChannels& channels) {
  return {"ouster_driver", channels.all, [channels] {
            return std::make_unique<lidar_driver::DriverAdapter<OusterFamily>>(
                lidar_driver::DriverChannels{channels.raw_sweep, channels.raw_imu, ""});
          }};
}

}  // namespace understory::ouster_driver
