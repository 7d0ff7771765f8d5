// Parameters of the Velodyne driver.
#pragma once

#include <string>

#include "common/io/velodyne.hpp"

namespace understory::velodyne_driver {

/// Where packets come from and to.
struct VelodyneNetworkParameters {
  /// 0.0.0.0 = every address of this computer; with another one no broadcasts are received, which
  /// is how the sensors send when they are new.
  std::string bind_address = "0.0.0.0";
  std::string sensor_address;             ///< Packets of others are refused; empty = the first one.
  int data_port = io::kVelodyneDataPort;  ///< 0 = any free one; LOG says which.
  int position_port = io::kVelodynePositionPort;  ///< 0 = any free one.
  int receive_buffer_bytes = 4194304;             ///< Asked of the kernel.
};

/// Which sensor it is.
struct VelodyneSensorParameters {
  std::string model = "vlp16";   ///< "vlp16", "vlp32c", "hdl32e" or "hdl64e".
  std::string calibration_file;  ///< The HDL-64E's own XML or YAML.
  double max_range_m = 0.0;      ///< 0 = the model's.
  double silence_s = 1.0;        ///< Without a good packet for so long the sensor is silent.
};

/// Whose clock stamps the sweeps.
struct VelodyneTimeParameters {
  std::string source = "sensor";  ///< "sensor" or "received"; see velodyne_driver.hpp.
  double tolerance_s = 0.5;       ///< A sensor's clock farther from the computer's is reported.
};

/// Fixes of the receiver at the sensor.
struct VelodyneGnssParameters {
  bool is_published = true;  ///< False: another receiver gives RAW_GNSS.
  bool has_origin = false;   ///< Else metres count from the first fix since the start.
  double origin_latitude_deg = 0.0;
  double origin_longitude_deg = 0.0;
};

/// All parameters of the driver.
struct VelodyneDriverParameters {
  VelodyneNetworkParameters network;
  VelodyneSensorParameters sensor;
  VelodyneTimeParameters time;
  VelodyneGnssParameters gnss;
};

}  // namespace understory::velodyne_driver
