#include "services/lidar_imu_input/sensor_clock.hpp"

#include <cmath>
#include <cstdlib>

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr model::Utime kSmallOffset_us = 20'000;  // indistinguishable from jitter
/// Largest lag of a sensor's first stamp behind the others'.
constexpr double kLargestLag_s = 10.0;

}  // namespace

bool SensorClock::is_plausible(model::Utime utime, std::optional<model::Utime> others) const {
  if (!last_) {
    const double ahead = others ? seconds_between(*others, utime) : 0.0;
    return ahead >= -kLargestLag_s && ahead <= parameters_.clock_jump_s;
  }
  const double step = seconds_between(*last_, utime);
  if (step < -parameters_.clock_jump_s) return false;
  if (step <= longest_step_s() || !others) return true;
  // A long pause is silence if the others' time has advanced as well, else a jump.
  return seconds_between(*others, utime) <= parameters_.clock_jump_s;
}

SensorClock::Answer SensorClock::take(model::Utime raw, std::optional<model::Utime> others) {
  const model::Utime utime = raw + offset_;
  // In quarantine, only a stamp that continues the last good one ends it early.
  const bool suspected = first_candidate_ && last_ && utime <= *last_;
  if (suspected || !is_plausible(utime, others)) return quarantine(raw, others);
  first_candidate_.reset();
  if (last_ && utime <= *last_) return {Verdict::kLate, utime};

  // A pause is not used for the sensor's period.
  const bool is_pause =
      last_ && period_us_ > 0.0 && seconds_between(*last_, utime) > longest_step_s();
  if (last_ && !is_pause) {
    const auto step = static_cast<double>(utime - *last_);
    period_us_ = period_us_ == 0.0 ? step : period_us_ + 0.1 * (step - period_us_);
  }
  last_ = utime;
  return {Verdict::kFine, utime};
}

SensorClock::Answer SensorClock::quarantine(model::Utime raw, std::optional<model::Utime> others) {
  const bool agrees =
      first_candidate_ && raw > candidate_ && seconds_between(candidate_, raw) <= longest_step_s();
  if (!agrees) {
    first_candidate_ = raw;
    candidate_ = raw;
    agreeing_ = 1;
    return {Verdict::kJumped, raw + offset_};
  }

  candidate_ = raw;
  ++agreeing_;
  const bool long_enough = agreeing_ >= 2 && seconds_between(*first_candidate_, raw) >= 1.0;
  if (agreeing_ < parameters_.resync_samples && !long_enough) return {Verdict::kQuarantined, 0};

  // From now on an offset makes the stamps continue the good ones, or those of the others.
  if (last_) {
    offset_ = *last_ + static_cast<model::Utime>(std::llround(period_us_)) - *first_candidate_;
    if (std::abs(offset_) < kSmallOffset_us && raw > *last_) offset_ = 0;
  } else {
    offset_ = others.value_or(raw) - raw;
  }
  first_candidate_.reset();
  last_ = raw + offset_;
  return {Verdict::kFollowed, *last_};
}

bool SensorClock::share_offset(model::Utime raw, model::Utime offset_us, model::Utime before) {
  if (raw + offset_us <= before) return false;
  offset_ = offset_us;
  last_ = raw + offset_us;
  return true;
}

}  // namespace understory::lidar_imu_input
