// The parts of an LCM URL over UDP multicast.
#pragma once

#include <cstdint>
#include <string>

namespace understory::bus {

/// The values that a receiver needs from `udpm://ADDRESS:PORT?recv_buf_size=BYTES&ttl=N`.
struct UdpmUrl {
  std::uint32_t address = 0xEFFF4C43;  ///< Host byte order; LCM's own 239.255.76.67 unless stated.
  std::uint16_t port = 7667;
  std::int64_t receive_buffer_bytes = 0;  ///< 0 = the kernel's default.
  std::uint8_t ttl = 0;  ///< Above 0, datagrams go to the network and come from it.
};

/// Whether the URL is of this kind.
bool is_udpm_url(const std::string& url);

/// Throws BusError with the URL where the address is no IPv4 multicast group or a number is
/// invalid.
UdpmUrl parse_udpm_url(const std::string& url);

}  // namespace understory::bus
