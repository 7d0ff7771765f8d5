#include "services/velodyne_driver/adapter_parameters.hpp"

namespace understory::velodyne_driver {

void describe(VelodyneDriverParameters& p, bus::ParameterTable& table) {
  lidar_driver::describe(p.network, table, [&] {
    lidar_driver::describe_port("network.data_port", p.ports.data, table);
    lidar_driver::describe_port("network.position_port", p.ports.position, table);
  });
  table.add("sensor.model", p.sensor.model, {"vlp16", "vlp32c", "hdl32e", "hdl64e"},
            "Model of the laser.");
  table.add("sensor.calibration_file", p.sensor.calibration_file, {},
            "The HDL-64E's own XML or YAML file; the other models need none.");
  lidar_driver::describe(p.range, table);
  lidar_driver::describe(
      p.time, table,
      "Stamps: the sensor's clock within the computer's hour, or the time of reception.");
  table.add("gnss.is_published", p.gnss.is_published,
            "False: another receiver publishes RAW_GNSS, which has one sender.");
  table.add("gnss.has_origin", p.gnss.has_origin,
            "RAW_GNSS counts from the origin given here; false: from the first fix.");
  table.add("gnss.origin_latitude_deg", p.gnss.origin_latitude_deg, {-89.0, 89.0}, "deg", "North.");
  table.add("gnss.origin_longitude_deg", p.gnss.origin_longitude_deg, {-180.0, 180.0}, "deg",
            "East.");
}

}  // namespace understory::velodyne_driver
