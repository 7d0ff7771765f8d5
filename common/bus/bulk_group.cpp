#include "common/bus/bulk_group.hpp"

#include <algorithm>
#include <regex>
#include <thread>

namespace understory::bus {

bool is_bulk_channel(std::string_view channel) {
  return channel.starts_with("RAW_SWEEP") || channel.starts_with("LIDAR_SWEEP");
}

std::string bulk_lcm_url(const std::string& lcm_url) {
  static const std::regex pattern(R"(udpm://(\d+\.\d+\.\d+\.)(\d+):(\d+)(.*))");
  std::smatch parts;
  if (!std::regex_match(lcm_url, parts, pattern)) return lcm_url;
  const int last = std::stoi(parts[2]);
  const int port = std::stoi(parts[3]);
  return "udpm://" + parts[1].str() + std::to_string(last < 255 ? last + 1 : last - 1) + ":" +
         std::to_string(port < 65535 ? port + 1 : port - 1) + parts[4].str();
}

void Pacer::wait_to_send(std::size_t bytes) {
  using Clock = std::chrono::steady_clock;
  std::this_thread::sleep_until(free_);
  const std::chrono::duration<double> taken(static_cast<double>(bytes) / bytes_per_s_);
  free_ = std::max(free_, Clock::now()) + std::chrono::duration_cast<Clock::duration>(taken);
}

}  // namespace understory::bus
