#include "services/velodyne_driver/velodyne_clock.hpp"

#include <cmath>
#include <cstdlib>

namespace understory::velodyne_driver {
namespace {

constexpr model::Utime kHour_us = 3'600'000'000;
constexpr model::Utime kOffsetPeriod_us = 10'000'000;
/// Sensor's and computer's clock may differ so much in what passed between two packets.
constexpr model::Utime kLargestMismatch_us = 1'000'000;

/// The difference that is nearest to zero.
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

void VelodyneClock::measure(model::Utime received) {
  const model::Utime period = utime_ / kOffsetPeriod_us;
  if (period != period_) {
    offset_before_ = offset_;
    offset_ = kNone;
    period_ = period;
  }
  offset_ = std::min(offset_, received - utime_);
}

VelodyneClock::Reading VelodyneClock::take(std::uint32_t past_hour_us, model::Utime received) {
  Step step = Step::kNext;
  if (!has_started_) {
    has_started_ = true;
    put_into_hour(past_hour_us, received);
  } else {
    // Both clocks should have advanced alike.
    const model::Utime passed = received - received_;
    model::Utime delta = hour_difference(past_hour_us_, past_hour_us);
    if (std::abs(delta - passed) <= kLargestMismatch_us) {
      if (delta < 0 && delta >= -kLargestDisorder_us) return {Step::kLate, utime_ + delta};
      utime_ += delta;
    } else {
      // Silent for more than half an hour, or one of the clocks was set.
      const model::Utime before = utime_;
      put_into_hour(past_hour_us, received);
      delta = utime_ - before;
      forget_offset();
      if (std::abs(delta - passed) > kLargestMismatch_us && delta > kLargestGap_us)
        step = Step::kJump;
    }

    if (delta < 0) step = Step::kJump;
    if (step == Step::kNext && delta > kLargestGap_us) step = Step::kGap;
    if (step == Step::kJump) forget_offset();
  }

  past_hour_us_ = past_hour_us;
  received_ = received;
  measure(received);
  return {step, utime_};
}

std::optional<model::Utime> VelodyneClock::offset_us() const {
  const model::Utime least = std::min(offset_, offset_before_);
  if (least == kNone) return std::nullopt;
  return least;
}

}  // namespace understory::velodyne_driver
