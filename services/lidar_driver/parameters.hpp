// Parameters common to all drivers of lasers.
#pragma once

#include <string>

#include "common/bus/parameter_table.hpp"

namespace understory::lidar_driver {

/// Network addresses, without the ports.
struct NetworkParameters {
  /// 0.0.0.0 = every address of this computer; with another one no broadcasts are received.
  std::string bind_address = "0.0.0.0";
  std::string
      sensor_address;  ///< Packets from other senders are refused; empty = the first sender.
  int receive_buffer_bytes = 4194304;  ///< Requested from the kernel.
};

/// Limits of range and of silence.
struct RangeParameters {
  double max_range_m = 0.0;  ///< 0 = the model's.
  double silence_s = 1.0;    ///< Time without a good packet after which the sensor is silent.
};

/// Clock of the sweeps' stamps.
struct TimeParameters {
  std::string source = "sensor";  ///< "sensor" or "received".
  double tolerance_s = 0.5;       ///< A sensor's clock farther from the computer's is reported.
};

/// Adds `network.*` without ports; `ports` adds them in between.
template <class Ports>
void describe(NetworkParameters& p, bus::ParameterTable& table, Ports ports) {
  table.add("network.bind_address", p.bind_address, {},
            "This computer's IPv4 address to listen on; 0.0.0.0: all, and broadcasts.");
  table.add("network.sensor_address", p.sensor_address, {},
            "The sensor's IPv4 address; empty: the first sender.");
  ports();
  table.add("network.receive_buffer_bytes", p.receive_buffer_bytes, {4096, 1073741824}, "bytes",
            "Receive buffer; the kernel grants at most net.core.rmem_max.");
}
/// Adds a UDP port.
void describe_port(const std::string& key, int& port, bus::ParameterTable& table);
/// Adds `sensor.max_range_m` and `sensor.silence_s`.
void describe(RangeParameters& p, bus::ParameterTable& table);
/// Adds `time.*`; `sources` describes the two sources.
void describe(TimeParameters& p, bus::ParameterTable& table, const std::string& sources);
/// Throws ConfigurationError on an invalid address.
void check_addresses(const NetworkParameters& network);
/// The text of a file that a parameter names. Throws ConfigurationError with `key` in the message.
std::string read_parameter_file(const std::string& key, const std::string& path);

}  // namespace understory::lidar_driver
