#include "services/livox_driver/adapter_parameters.hpp"

namespace understory::livox_driver {

void describe(LivoxDriverParameters& p, bus::ParameterTable& table) {
  lidar_driver::describe(p.network, table, [&] {
    lidar_driver::describe_port("network.points_port", p.ports.points, table);
    lidar_driver::describe_port("network.imu_port", p.ports.imu, table);
  });
  table.add("sensor.model", p.sensor.model, {"mid360", "hap"}, "Model of the laser.");
  table.add("sensor.period_s", p.sensor.period_s, {0.01, 10.0}, "s",
            "Duration of a sweep: the pattern does not repeat.");
  lidar_driver::describe(p.range, table);
  lidar_driver::describe(p.time, table,
                         "Stamps: the laser's clock (PTP, gPTP or GPS), or the time of reception.");
  table.add("imu.is_published", p.imu.is_published,
            "False: another device publishes RAW_IMU, which has one sender.");
}

}  // namespace understory::livox_driver
