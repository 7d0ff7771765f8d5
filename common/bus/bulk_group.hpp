// Sweeps have a multicast group of their own, so that only processes that subscribe sweeps receive
// their packets.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

namespace understory::bus {

/// Whether a channel carries bulk: RAW_SWEEP and LIDAR_SWEEP, with any suffix.
bool is_bulk_channel(std::string_view channel);

/// The group beside `lcm_url`: address and port one higher; a URL that is not udpm:// is returned
/// unchanged.
std::string bulk_lcm_url(const std::string& lcm_url);

/// Limits a sender's rate, so that a burst fits into the receivers' socket buffers.
class Pacer {
 public:
  /// `bytes_per_s` > 0.
  explicit Pacer(double bytes_per_s) : bytes_per_s_(bytes_per_s) {}
  /// Call it before sending a message of this size: it sleeps until the rate permits the message.
  void wait_to_send(std::size_t bytes);

 private:
  double bytes_per_s_;
  std::chrono::steady_clock::time_point free_;
};

}  // namespace understory::bus
