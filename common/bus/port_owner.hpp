// Finds the program that has a UDP port, for the error message when the port cannot be shared.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace understory::bus {

/// A bound UDP socket in the kernel's list.
struct BoundSocket {
  bool is_any_address = false;
  std::uint32_t address = 0;  ///< IPv4, host byte order; 0 for an IPv6 socket.
  std::uint16_t port = 0;
  std::uint32_t user = 0;
  std::uint64_t inode = 0;
};

/// The sockets in the text of /proc/net/udp or udp6; lines of another form are skipped.
std::vector<BoundSocket> parse_udp_table(const std::string& text);

/// The programs that prevent binding `address` (host byte order) and `port`: "`name` (process 12,
/// user 0)", at most three; only the user where other users' processes are not readable; "an
/// unknown program" where none is listed. Reads /proc of all processes: some milliseconds.
std::string owners_of_udp_port(std::uint32_t address, std::uint16_t port);

}  // namespace understory::bus
