// Parameters of the Velodyne driver.
#pragma once

#include <string>

#include "common/io/velodyne.hpp"
#include "services/lidar_driver/parameters.hpp"

namespace understory::velodyne_driver {

/// UDP ports; 0 = any free one, reported in LOG.
struct VelodynePortParameters {
  int data = io::kVelodyneDataPort;
  int position = io::kVelodynePositionPort;
};

/// The sensor's model and calibration.
struct VelodyneSensorParameters {
  std::string model = "vlp16";   ///< "vlp16", "vlp32c", "hdl32e" or "hdl64e".
  std::string calibration_file;  ///< The HDL-64E's own XML or YAML.
};

/// Fixes of the GNSS receiver at the sensor.
struct VelodyneGnssParameters {
  bool is_published = true;  ///< False: another receiver gives RAW_GNSS.
  bool has_origin = false;   ///< False: the origin is the first fix since the start.
  double origin_latitude_deg = 0.0;
  double origin_longitude_deg = 0.0;
};

/// All parameters of the driver. A new sensor sends broadcasts: network.bind_address 0.0.0.0.
struct VelodyneDriverParameters {
  lidar_driver::NetworkParameters network;
  VelodynePortParameters ports;
  VelodyneSensorParameters sensor;
  lidar_driver::RangeParameters range;
  lidar_driver::TimeParameters time;  ///< See velodyne_driver.hpp.
  VelodyneGnssParameters gnss;
};

}  // namespace understory::velodyne_driver
