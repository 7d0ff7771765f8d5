// Parameters of the Ouster driver.
#pragma once

#include <string>

#include "common/packets/ouster_stream.hpp"
#include "services/lidar_driver/parameters.hpp"

namespace understory::ouster_driver {

/// UDP ports, equal to the sensor's `udp_port_lidar` and `udp_port_imu`; 0 = any free one.
struct OusterPortParameters {
  int lidar = packets::kOusterLidarPort;
  int imu = packets::kOusterImuPort;
};

/// The sensor's metadata.
struct OusterSensorParameters {
  std::string metadata_file;  ///< JSON, as received from the sensor by HTTP.
};

/// The IMU inside the laser.
struct OusterImuParameters {
  bool is_published = true;  ///< False: another unit on the vehicle gives RAW_IMU.
};

/// All parameters of the driver.
struct OusterDriverParameters {
  lidar_driver::NetworkParameters network;
  OusterPortParameters ports;
  OusterSensorParameters sensor;
  lidar_driver::RangeParameters range;
  lidar_driver::TimeParameters time;  ///< See lidar_driver/packet_stage.hpp.
  OusterImuParameters imu;
};

}  // namespace understory::ouster_driver
