// The parts of an LCM URL over UDP multicast.
#pragma once

#include <cstdint>
#include <string>

namespace understory::bus {

/// What a receiver needs of `udpm://ADDRESS:PORT?recv_buf_size=BYTES&ttl=N`.
struct UdpmUrl {
  std::uint32_t address = 0xEFFF4C43;  ///< Host byte order; LCM's own 239.255.76.67 unless stated.
  std::uint16_t port = 7667;
  std::int64_t receive_buffer_bytes = 0;  ///< 0 = what the kernel gives unasked.
  std::uint8_t ttl = 0;                   ///< Above 0 the network hears the group, and is heard.
};

/// Whether the URL is of this kind.
bool is_udpm_url(const std::string& url);

/// Throws BusError naming the URL where the address is no IPv4 multicast group or a number is none.
UdpmUrl parse_udpm_url(const std::string& url);

}  // namespace understory::bus
