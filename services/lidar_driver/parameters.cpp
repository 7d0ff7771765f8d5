#include "services/lidar_driver/parameters.hpp"

#include <filesystem>

#include "common/io/data_error.hpp"
#include "common/io/recording_folder.hpp"
#include "services/lidar_driver/udp_socket.hpp"

namespace understory::lidar_driver {

void describe_port(const std::string& key, int& port, bus::ParameterTable& table) {
  table.add(key, port, {0, 65535}, "", "UDP; 0: any free one (see LOG).");
}

void describe(RangeParameters& p, bus::ParameterTable& table) {
  table.add("sensor.max_range_m", p.max_range_m, {0.0, 1000.0}, "m",
            "Farther returns are left out; 0: the model's range.");
  table.add("sensor.silence_s", p.silence_s, {0.01, 3600.0}, "s",
            "Time without a valid packet after which the sensor is silent.");
}

void describe(TimeParameters& p, bus::ParameterTable& table, const std::string& sources) {
  table.add("time.source", p.source, {"sensor", "received"}, sources);
  table.add("time.tolerance_s", p.tolerance_s, {1e-4, 3600.0}, "s",
            "With source \"sensor\": a larger difference from the computer's clock is reported.");
}

void check_addresses(const NetworkParameters& network) {
  const auto check = [](const std::string& key, const std::string& address) {
    if (!parse_ipv4(address))
      throw bus::ConfigurationError({key + ": \"" + address + "\" is not an IPv4 address"});
  };
  check("network.bind_address", network.bind_address);
  if (!network.sensor_address.empty()) check("network.sensor_address", network.sensor_address);
}

std::string read_parameter_file(const std::string& key, const std::string& path) {
  try {
    const std::filesystem::path file(path);
    const auto folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
    return io::RecordingFolder(folder).read(file.filename().string());
  } catch (const io::DataError& error) {
    throw bus::ConfigurationError({key + ": " + error.what()});
  }
}

}  // namespace understory::lidar_driver
