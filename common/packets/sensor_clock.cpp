#include "common/packets/sensor_clock.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace understory::packets {
namespace {

constexpr model::Utime kLatest_us = 4'000'000'000'000'000;

}  // namespace

void SensorClock::place(std::int64_t sensor_ns, std::int64_t received_ns) {
  const std::int64_t difference = received_ns - sensor_ns;
  moved_ns_ = std::abs(difference) < kSameTime_ns ? 0 : difference;
}

SensorClock::Step SensorClock::take(std::int64_t sensor_ns, model::Utime received) {
  const std::int64_t received_ns = std::clamp(received, -kLatest_us, kLatest_us) * 1000;
  // In doubles, because differences of damaged packets may be large.
  const double mismatch_ns =
      (static_cast<double>(received_ns) - static_cast<double>(received_ns_)) -
      (static_cast<double>(sensor_ns) - static_cast<double>(sensor_ns_));
  const bool is_first = !has_started_;
  const bool has_jumped =
      !is_first && std::abs(mismatch_ns) > static_cast<double>(kLargestMismatch_ns);
  if (is_first || has_jumped) place(sensor_ns, received_ns);

  has_started_ = true;
  sensor_ns_ = sensor_ns;
  received_ns_ = received_ns;
  lag_us_ = (received_ns - placed_ns(sensor_ns)) / 1000;
  return has_jumped ? Step::kJump : Step::kNext;
}

}  // namespace understory::packets
