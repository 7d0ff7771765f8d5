// Parameters of the Hesai driver.
#pragma once

#include <string>

#include "common/packets/hesai_stream.hpp"
#include "services/lidar_driver/parameters.hpp"

namespace understory::hesai_driver {

/// UDP ports of this computer that the laser sends to; 0 = any free one.
struct HesaiPortParameters {
  int data = packets::kHesaiPort;
};

/// The sensor's model and calibration.
struct HesaiSensorParameters {
  std::string model = "xt32";  ///< A name for packets::hesai_model().
  std::string angle_file;      ///< The sensor's own angle correction file (CSV); empty = nominal.
};

/// All parameters of the driver.
struct HesaiDriverParameters {
  lidar_driver::NetworkParameters network;
  HesaiPortParameters ports;
  HesaiSensorParameters sensor;
  lidar_driver::RangeParameters range;
  lidar_driver::TimeParameters time;  ///< See lidar_driver/packet_stage.hpp.
};

}  // namespace understory::hesai_driver
