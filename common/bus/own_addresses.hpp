// Whether a datagram came from this computer.
#pragma once

#include <cstdint>
#include <vector>

namespace understory::bus {

/// The IPv4 addresses of this computer's interfaces. A kernel takes no packet with one of them as
/// its source from a network, so the source tells. Interfaces come and go: an address that is not
/// known is looked up again, at most once a second.
class OwnAddresses {
 public:
  /// `address` in host byte order; `now_us` on any steady clock.
  bool contains(std::uint32_t address, std::int64_t now_us);

 private:
  std::vector<std::uint32_t> addresses_;
  std::int64_t looked_us_ = -1;  ///< -1 = never.
};

}  // namespace understory::bus
