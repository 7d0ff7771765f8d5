#include "services/velodyne_driver/adapter_parameters.hpp"

namespace understory::velodyne_driver {
namespace {

void describe_network(VelodyneNetworkParameters& p, bus::ParameterTable& table) {
  table.add("network.bind_address", p.bind_address, {},
            "This computer's IPv4 address to listen on; 0.0.0.0: all, and broadcasts.");
  table.add("network.sensor_address", p.sensor_address, {},
            "The sensor's IPv4 address; empty: whoever speaks first.");
  table.add("network.data_port", p.data_port, {0, 65535}, "", "UDP; 0: any free one (see LOG).");
  table.add("network.position_port", p.position_port, {0, 65535}, "",
            "UDP; 0: any free one (see LOG).");
  table.add("network.receive_buffer_bytes", p.receive_buffer_bytes, {4096, 1073741824}, "bytes",
            "Asked of the kernel, which gives at most net.core.rmem_max.");
}

void describe_sensor(VelodyneSensorParameters& p, bus::ParameterTable& table) {
  table.add("sensor.model", p.model, {"vlp16", "vlp32c", "hdl32e", "hdl64e"},
            "What the packets are of.");
  table.add("sensor.calibration_file", p.calibration_file, {},
            "The HDL-64E's own XML or YAML file; the other models need none.");
  table.add("sensor.max_range_m", p.max_range_m, {0.0, 1000.0}, "m",
            "Returns from farther are left out; 0: the model's range.");
  table.add("sensor.silence_s", p.silence_s, {0.01, 3600.0}, "s",
            "Without a good packet for so long the sensor counts as silent.");
}

}  // namespace

void describe(VelodyneDriverParameters& p, bus::ParameterTable& table) {
  describe_network(p.network, table);
  describe_sensor(p.sensor, table);
  table.add("time.source", p.time.source, {"sensor", "received"},
            "Stamps: the sensor's clock within the computer's hour, or when packets came.");
  table.add("time.tolerance_s", p.time.tolerance_s, {1e-4, 3600.0}, "s",
            "With source \"sensor\": a clock farther from the computer's is reported.");
  table.add("gnss.is_published", p.gnss.is_published,
            "False: another receiver on the vehicle gives RAW_GNSS, which has one sender.");
  table.add("gnss.has_origin", p.gnss.has_origin,
            "RAW_GNSS counts from the origin given here; false: from the first fix.");
  table.add("gnss.origin_latitude_deg", p.gnss.origin_latitude_deg, {-89.0, 89.0}, "deg", "North.");
  table.add("gnss.origin_longitude_deg", p.gnss.origin_longitude_deg, {-180.0, 180.0}, "deg",
            "East.");
}

}  // namespace understory::velodyne_driver
