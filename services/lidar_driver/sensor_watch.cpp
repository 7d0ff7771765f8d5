#include "services/lidar_driver/sensor_watch.hpp"

#include <utility>

#include "services/lidar_driver/udp_socket.hpp"

namespace understory::lidar_driver {
namespace {

constexpr std::int64_t kSecond_us = 1'000'000;

}  // namespace

void SenderFilter::fix(const std::string& address) {
  is_fixed_ = !address.empty();
  sensor_ = parse_ipv4(address);
}

bool SenderFilter::admits(std::uint32_t sender) {
  if (!sensor_ || *sensor_ == sender) return true;
  ++refused_;
  return false;
}

void SenderFilter::forget() {
  if (!is_fixed_) sensor_.reset();
}

void SilenceWatch::start(std::int64_t now_us) {
  if (good_us_ < 0) good_us_ = reported_us_ = now_us;
}

bool SilenceWatch::hear(std::int64_t now_us) {
  good_us_ = now_us;
  return std::exchange(is_silent_, false);
}

SilenceWatch::Due SilenceWatch::look(std::int64_t now_us) {
  const bool a_second_passed = now_us - reported_us_ >= kSecond_us;
  if (!a_second_passed && !is_overdue(now_us)) return Due::kNothing;

  const bool was_silent = std::exchange(is_silent_, is_overdue(now_us));
  if (is_silent_ && was_silent && !a_second_passed) return Due::kNothing;
  reported_us_ = now_us;
  return is_silent_ ? Due::kReportSilence : Due::kCheckClock;
}

}  // namespace understory::lidar_driver
