// Which program has a UDP port: for the message when it cannot be shared.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace understory::bus {

/// A bound UDP socket as the kernel lists it.
struct BoundSocket {
  bool is_any_address = false;
  std::uint32_t address = 0;  ///< IPv4, host byte order; 0 of an IPv6 socket.
  std::uint16_t port = 0;
  std::uint32_t user = 0;
  std::uint64_t inode = 0;
};

/// The sockets in the text of /proc/net/udp or udp6; lines of another form are passed over.
std::vector<BoundSocket> parse_udp_table(const std::string& text);

/// Who stands in the way of binding `address` (host byte order) and `port`: "`name` (process 12,
/// user 0)", up to three of them; the user alone where processes of others cannot be looked into;
/// "an unknown program" where nothing is listed. Reads /proc of all processes: some milliseconds.
std::string owners_of_udp_port(std::uint32_t address, std::uint16_t port);

}  // namespace understory::bus
