#include "services/ouster_driver/adapter_parameters.hpp"

namespace understory::ouster_driver {

void describe(OusterDriverParameters& p, bus::ParameterTable& table) {
  lidar_driver::describe(p.network, table, [&] {
    lidar_driver::describe_port("network.lidar_port", p.ports.lidar, table);
    lidar_driver::describe_port("network.imu_port", p.ports.imu, table);
  });
  table.add(
      "sensor.metadata_file", p.sensor.metadata_file, {},
      "The sensor's metadata (JSON), which say where its beams point and what its packets are.");
  lidar_driver::describe(p.range, table);
  lidar_driver::describe(
      p.time, table,
      "Stamps: the sensor's clock (PTP, or NMEA and sync pulse), or when packets came.");
  table.add("imu.is_published", p.imu.is_published,
            "False: another unit on the vehicle gives RAW_IMU, which has one sender.");
}

}  // namespace understory::ouster_driver
