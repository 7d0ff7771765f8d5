#include "services/ouster_driver/adapter_parameters.hpp"

namespace understory::ouster_driver {

void describe(OusterDriverParameters& p, bus::ParameterTable& table) {
  lidar_driver::describe(p.network, table, [&] {
    lidar_driver::describe_port("network.lidar_port", p.ports.lidar, table);
    lidar_driver::describe_port("network.imu_port", p.ports.imu, table);
  });
  table.add("sensor.metadata_file", p.sensor.metadata_file, {},
            "The sensor's metadata (JSON) with its beam angles and packet format.");
  lidar_driver::describe(p.range, table);
  lidar_driver::describe(
      p.time, table,
      "Stamps: the sensor's clock (PTP, or NMEA and sync pulse), or the time of reception.");
  table.add("imu.is_published", p.imu.is_published,
            "False: another device publishes RAW_IMU, which has one sender.");
}

}  // namespace understory::ouster_driver
