#include "services/lidar_imu_input/input_guard.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace understory::lidar_imu_input {
namespace {

constexpr double kNeverSilent_s = 1e9;
constexpr model::Utime kSmallOffset_us = 20'000;  // not told apart from jitter

double seconds_between(model::Utime from, model::Utime to) {
  return static_cast<double>(to - from) * 1e-6;
}

}  // namespace

std::string channel_of(Sensor sensor) {
  switch (sensor) {
    case Sensor::kImu:
      return "RAW_IMU";
    case Sensor::kWheels:
      return "RAW_WHEELS";
    case Sensor::kGnss:
      return "RAW_GNSS";
    case Sensor::kSweep:
      return "RAW_SWEEP";
    case Sensor::kScan:
      return "RAW_SCAN";
  }
  return "";
}

bool SensorClock::is_plausible(model::Utime utime, std::optional<model::Utime> others) const {
  const double step = seconds_between(*last_, utime);
  if (step < -parameters_.clock_jump_s) return false;
  if (step <= parameters_.clock_jump_s || !others) return true;
  // A long pause is silence where the others' time has gone on as well, else a jump.
  return seconds_between(*others, utime) <= parameters_.clock_jump_s;
}

SensorClock::Answer SensorClock::take(model::Utime raw, std::optional<model::Utime> others) {
  const model::Utime utime = raw + offset_;
  // Once in quarantine, only a stamp that goes on behind the last good one ends it early.
  const bool suspected = first_candidate_ && utime <= last_.value_or(utime);
  const bool resumes = is_resumed_ && last_ && utime > *last_;
  if (resumes) is_resumed_ = false;
  if (last_ && !resumes && (suspected || !is_plausible(utime, others))) return quarantine(raw);
  first_candidate_.reset();
  if (last_ && utime <= *last_) return {Verdict::kLate, utime};
  if (last_ && !(resumes && seconds_between(*last_, utime) > parameters_.clock_jump_s)) {
    const auto step = static_cast<double>(utime - *last_);
    period_us_ = period_us_ == 0.0 ? step : period_us_ + 0.1 * (step - period_us_);
  }
  last_ = utime;
  return {Verdict::kFine, utime};
}

SensorClock::Answer SensorClock::quarantine(model::Utime raw) {
  const bool agrees =
      first_candidate_ && raw > candidate_ &&
      seconds_between(candidate_, raw) <= parameters_.clock_jump_s + 3e-6 * period_us_;
  if (!agrees) {
    first_candidate_ = raw;
    candidate_ = raw;
    agreeing_ = 1;
    return {Verdict::kJumped, 0};
  }
  candidate_ = raw;
  ++agreeing_;
  const bool long_enough = agreeing_ >= 2 && seconds_between(*first_candidate_, raw) >= 1.0;
  if (agreeing_ < parameters_.resync_samples && !long_enough) return {Verdict::kQuarantined, 0};
  offset_ = *last_ + static_cast<model::Utime>(std::llround(period_us_)) - *first_candidate_;
  if (std::abs(offset_) < kSmallOffset_us && raw > *last_) offset_ = 0;
  first_candidate_.reset();
  last_ = raw + offset_;
  return {Verdict::kFollowed, *last_};
}

InputGuard::InputGuard(const FaultParameters& parameters, const ImuParameters& imu)
    : parameters_(parameters), imu_(imu), states_(kSensors, State{SensorClock(parameters)}) {}

std::optional<model::Utime> InputGuard::newest_but(Sensor sensor) const {
  std::optional<model::Utime> newest;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const auto last = states_[i].clock.last();
    if (i != static_cast<std::size_t>(sensor) && last)
      newest = std::max(*last, newest.value_or(*last));
  }
  return newest;
}

std::optional<model::Utime> InputGuard::now() const {
  std::optional<model::Utime> newest;
  for (const State& state : states_) {
    if (const auto last = state.clock.last()) newest = std::max(*last, newest.value_or(*last));
  }
  return newest;
}

std::optional<model::Utime> InputGuard::admit(Sensor sensor, model::Utime raw,
                                              std::vector<InputFault>& faults) {
  State& state = this->state(sensor);
  const SensorClock::Answer answer = state.clock.take(raw, newest_but(sensor));
  const std::string channel = channel_of(sensor);
  switch (answer.verdict) {
    case SensorClock::Verdict::kLate:
      faults.push_back({InputFaultKind::kLate, channel, "a stamp not after the one before"});
      return std::nullopt;
    case SensorClock::Verdict::kJumped:
      faults.push_back(
          {InputFaultKind::kClockJump, channel,
           fmt::format("the clock jumped by {:+.3f} s: not believed yet",
                       seconds_between(*state.clock.last(), raw + state.clock.offset_us()))});
      return std::nullopt;
    case SensorClock::Verdict::kQuarantined:
      return std::nullopt;
    case SensorClock::Verdict::kFollowed:
      faults.push_back({InputFaultKind::kClockJump, channel,
                        fmt::format("stamps are moved by {:+.3f} s from now on",
                                    static_cast<double>(state.clock.offset_us()) * 1e-6)});
      break;
    case SensorClock::Verdict::kFine:
      break;
  }
  state.is_silent = false;
  return answer.utime;
}

bool InputGuard::is_frozen(const model::ImuSample& sample, std::vector<InputFault>& faults) {
  const bool same = same_since_ && same_since_->angular_rate_rad_s == sample.angular_rate_rad_s &&
                    same_since_->specific_force_mps2 == sample.specific_force_mps2;
  if (!same) {
    same_since_ = sample;
    is_frozen_ = false;
    return false;
  }
  if (seconds_between(same_since_->utime, sample.utime) < parameters_.frozen_s) return false;
  if (!is_frozen_)
    faults.push_back({InputFaultKind::kFrozen, channel_of(Sensor::kImu),
                      fmt::format("the same sample for {:.1f} s", parameters_.frozen_s)});
  is_frozen_ = true;
  return true;
}

bool InputGuard::is_saturated(const model::ImuSample& sample,
                              std::vector<InputFault>& faults) const {
  const bool rate = sample.angular_rate_rad_s.cwiseAbs().maxCoeff() >= imu_.gyro_range_rad_s;
  const bool force = sample.specific_force_mps2.cwiseAbs().maxCoeff() >= imu_.force_range_mps2;
  if (rate || force)
    faults.push_back({InputFaultKind::kSaturated, channel_of(Sensor::kImu),
                      rate ? "the gyro is at the end of its range"
                           : "the accelerometer is at the end of its range"});
  return rate || force;
}

double InputGuard::silent_s(Sensor sensor) const {
  switch (sensor) {
    case Sensor::kGnss:
      return kNeverSilent_s;  // a forest has no sky
    case Sensor::kSweep:
    case Sensor::kScan:
      return parameters_.sweep_silent_s;
    default:
      return parameters_.silent_s;
  }
}

bool InputGuard::is_live(Sensor sensor) const {
  return has_spoken(sensor) && seconds_between(*last(sensor), *now()) <= silent_s(sensor);
}

void InputGuard::find_silent(std::vector<InputFault>& faults) {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const auto sensor = static_cast<Sensor>(i);
    if (states_[i].is_silent || !has_spoken(sensor) || is_live(sensor)) continue;
    states_[i].is_silent = true;
    faults.push_back({InputFaultKind::kSilent, channel_of(sensor),
                      fmt::format("nothing for {:.2f} s", silent_s(sensor))});
  }
}

}  // namespace understory::lidar_imu_input
