#include "services/velodyne_driver/velodyne_clock.hpp"

#include <cmath>
#include <cstdlib>

namespace understory::velodyne_driver {
namespace {

constexpr model::Utime kHour_us = 3'600'000'000;
/// Largest difference between the sensor's and the computer's time from one packet to the next.
constexpr model::Utime kLargestMismatch_us = 1'000'000;

/// The difference modulo an hour, nearest to zero.
model::Utime hour_difference(std::uint32_t from, std::uint32_t to) {
  const model::Utime difference =
      (static_cast<model::Utime>(to) - static_cast<model::Utime>(from)) % kHour_us;
  if (difference > kHour_us / 2) return difference - kHour_us;
  if (difference <= -kHour_us / 2) return difference + kHour_us;
  return difference;
}

}  // namespace

void VelodyneClock::put_into_hour(std::uint32_t past_hour_us, model::Utime received) {
  const double hours =
      std::round(static_cast<double>(received - past_hour_us) / static_cast<double>(kHour_us));
  utime_ = static_cast<model::Utime>(hours) * kHour_us + past_hour_us;
}

VelodyneClock::Reading VelodyneClock::take(std::uint32_t past_hour_us, model::Utime received) {
  Step step = Step::kNext;
  if (!has_started_) {
    has_started_ = true;
    put_into_hour(past_hour_us, received);
  } else {
    // Both clocks should have advanced by the same time.
    const model::Utime passed = received - received_;
    model::Utime delta = hour_difference(past_hour_us_, past_hour_us);
    if (std::abs(delta - passed) <= kLargestMismatch_us) {
      if (delta < 0 && delta >= -kLargestDisorder_us) return {Step::kLate, utime_ + delta};
      utime_ += delta;
    } else {
      // The sensor was silent for more than half an hour, or one of the clocks was set.
      const model::Utime before = utime_;
      put_into_hour(past_hour_us, received);
      delta = utime_ - before;
      delay_.forget();
      if (std::abs(delta - passed) > kLargestMismatch_us && delta > kLargestGap_us)
        step = Step::kJump;
    }

    if (delta < 0) step = Step::kJump;
    if (step == Step::kNext && delta > kLargestGap_us) step = Step::kGap;
    if (step == Step::kJump) delay_.forget();
  }

  past_hour_us_ = past_hour_us;
  received_ = received;
  delay_.add(utime_, received);
  return {step, utime_};
}

}  // namespace understory::velodyne_driver
