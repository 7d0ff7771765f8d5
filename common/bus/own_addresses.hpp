// Whether a datagram came from this computer.
#pragma once

#include <cstdint>
#include <vector>

namespace understory::bus {

/// The IPv4 addresses of this computer's interfaces. The kernel drops packets from a network that
/// have one of them as source, so the source address is reliable. Interfaces can change: for an
/// unknown address the list is read again, at most once a second.
class OwnAddresses {
 public:
  /// `address` in host byte order; `now_us` on any steady clock.
  bool contains(std::uint32_t address, std::int64_t now_us);

 private:
  std::vector<std::uint32_t> addresses_;
  std::int64_t looked_us_ = -1;  ///< -1 = never.
};

}  // namespace understory::bus
