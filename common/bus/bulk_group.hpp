// Sweeps travel in a multicast group of their own, so that their packets reach those alone that
// take sweeps.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

namespace understory::bus {

/// Whether a channel carries bulk: RAW_SWEEP and LIDAR_SWEEP, with any suffix.
bool is_bulk_channel(std::string_view channel);

/// The group beside `lcm_url`: address and port one higher; a URL that is not udpm:// stays.
std::string bulk_lcm_url(const std::string& lcm_url);

/// Keeps a sender to a rate, so that a burst fits into the receivers' socket buffers.
class Pacer {
 public:
  /// `bytes_per_s` > 0.
  explicit Pacer(double bytes_per_s) : bytes_per_s_(bytes_per_s) {}
  /// Before a message of this size is sent: sleeps while those before it are too recent.
  void wait_to_send(std::size_t bytes);

 private:
  double bytes_per_s_;
  std::chrono::steady_clock::time_point free_;
};

}  // namespace understory::bus
