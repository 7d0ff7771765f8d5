// Parameters of the Livox driver.
#pragma once

#include <string>

#include "common/packets/livox_stream.hpp"
#include "services/lidar_driver/parameters.hpp"

namespace understory::livox_driver {

/// UDP ports of this computer that the laser sends to; 0 = any free one.
struct LivoxPortParameters {
  int points = packets::LivoxPorts{}.points;
  int imu = packets::LivoxPorts{}.imu;
};

/// The sensor's model and sweep period.
struct LivoxSensorParameters {
  std::string model = "mid360";  ///< "mid360" or "hap".
  double period_s = 0.1;         ///< Of a sweep: the pattern does not repeat.
};

/// The IMU inside the laser.
struct LivoxImuParameters {
  bool is_published = true;  ///< False: another unit on the vehicle gives RAW_IMU.
};

/// All parameters of the driver.
struct LivoxDriverParameters {
  lidar_driver::NetworkParameters network;
  LivoxPortParameters ports;
  LivoxSensorParameters sensor;
  lidar_driver::RangeParameters range;
  lidar_driver::TimeParameters time;  ///< See lidar_driver/packet_stage.hpp.
  LivoxImuParameters imu;
};

}  // namespace understory::livox_driver
