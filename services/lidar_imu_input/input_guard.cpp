#include "services/lidar_imu_input/input_guard.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr double kNeverSilent_s = 1e9;
/// Number of points of a sweep that are compared with the previous sweep.
constexpr std::size_t kComparedPoints = 64;

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

InputGuard::InputGuard(const FaultParameters& parameters, const ImuParameters& imu,
                       const ExpectedSensors& expected)
    : parameters_(parameters),
      imu_(imu),
      expected_(expected),
      states_(kSensors, State{SensorClock(parameters)}) {}

/// Newest stamp of all sensors but this one and GNSS, including the restart time after a pause.
std::optional<model::Utime> InputGuard::newest_but(Sensor sensor) const {
  std::optional<model::Utime> newest = resumed_;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const auto last = states_[i].clock.last();
    const auto other = static_cast<Sensor>(i);
    if (other == sensor || other == Sensor::kGnss || !last) continue;
    newest = std::max(*last, newest.value_or(*last));
  }
  return newest;
}

std::optional<model::Utime> InputGuard::now() const {
  std::optional<model::Utime> newest;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (static_cast<Sensor>(i) == Sensor::kGnss) continue;
    if (const auto last = states_[i].clock.last()) newest = std::max(*last, newest.value_or(*last));
  }
  return newest;
}

bool InputGuard::is_believable(model::Utime utime) const {
  const auto newest = time();
  return !newest || seconds_between(*newest, utime) <= parameters_.clock_jump_s;
}

bool InputGuard::has_others(Sensor sensor) const {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const auto other = static_cast<Sensor>(i);
    if (other != sensor && other != Sensor::kGnss && is_live(other)) return true;
  }
  return false;
}

/// Clocks that jumped together get the same offset: the delay between two sensors' first samples
/// must not become an offset between them.
void InputGuard::share_jump(Sensor sensor, model::Utime raw, std::optional<model::Utime> before) {
  SensorClock& clock = state(sensor).clock;
  for (const State& other : states_) {
    const model::Utime offset = other.clock.offset_us();
    if (&other == &state(sensor) || offset == 0) continue;
    if (std::abs(seconds_between(offset, clock.offset_us())) > parameters_.clock_jump_s) continue;
    if (clock.share_offset(raw, offset, before.value_or(raw + offset - 1))) return;
  }
}

std::optional<model::Utime> InputGuard::admit(Sensor sensor, model::Utime raw,
                                              std::vector<InputFault>& faults) {
  State& state = this->state(sensor);
  const std::optional<model::Utime> before = state.clock.last();
  const std::optional<model::Utime> others = newest_but(sensor);
  const SensorClock::Answer answer = state.clock.take(raw, others);
  const std::string channel = channel_of(sensor);
  switch (answer.verdict) {
    case SensorClock::Verdict::kLate:
      faults.push_back({InputFaultKind::kLate, channel, "a stamp not after the one before"});
      return std::nullopt;
    case SensorClock::Verdict::kJumped:
      faults.push_back({InputFaultKind::kClockJump, channel,
                        fmt::format("the clock is {:+.3f} s off: samples are left out for now",
                                    seconds_between(before ? *before : *others, answer.utime))});
      return std::nullopt;
    case SensorClock::Verdict::kQuarantined:
      return std::nullopt;
    case SensorClock::Verdict::kFollowed:
      share_jump(sensor, raw, before);
      faults.push_back({InputFaultKind::kClockJump, channel,
                        fmt::format("stamps are moved by {:+.3f} s from now on",
                                    static_cast<double>(state.clock.offset_us()) * 1e-6)});
      break;
    case SensorClock::Verdict::kFine:
      break;
  }
  state.is_silent = false;
  if (!first_) first_ = state.clock.last();
  return state.clock.last();
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

bool InputGuard::is_frozen(const model::PointSweep& sweep, std::vector<InputFault>& faults) {
  const auto count = std::min(sweep.points.size(), kComparedPoints);
  const auto same = [](const model::SweepPoint& a, const model::SweepPoint& b) {
    return a.x_m == b.x_m && a.y_m == b.y_m && a.z_m == b.z_m;
  };
  const bool is_repeated =
      count == kComparedPoints && first_points_.size() == count &&
      std::equal(first_points_.begin(), first_points_.end(), sweep.points.begin(), same);
  first_points_.assign(sweep.points.begin(),
                       sweep.points.begin() + static_cast<std::ptrdiff_t>(count));

  if (is_repeated)
    faults.push_back({InputFaultKind::kFrozen, channel_of(Sensor::kSweep),
                      "the same points as in the revolution before"});
  return is_repeated;
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
      return kNeverSilent_s;  // a forest blocks the sky
    case Sensor::kSweep:
    case Sensor::kScan:
      return parameters_.sweep_silent_s;
    default:
      return parameters_.silent_s;
  }
}

bool InputGuard::is_expected(Sensor sensor) const {
  switch (sensor) {
    case Sensor::kImu:
      return expected_.imu;
    case Sensor::kWheels:
      return expected_.wheels;
    case Sensor::kSweep:
      return expected_.sweep;
    case Sensor::kScan:
      return expected_.scan;
    case Sensor::kGnss:
      break;
  }
  return false;
}

bool InputGuard::is_silent(Sensor sensor) const {
  if (sensor == Sensor::kGnss) return false;
  if (has_spoken(sensor)) return !is_live(sensor);
  const auto newest = now();
  return is_expected(sensor) && newest && seconds_between(*first_, *newest) > silent_s(sensor);
}

bool InputGuard::is_live(Sensor sensor) const {
  const auto newest = now();
  if (!has_spoken(sensor) || !newest) return false;
  const model::Utime heard = std::max(*last(sensor), resumed_.value_or(*last(sensor)));
  return seconds_between(heard, *newest) <= silent_s(sensor);
}

bool InputGuard::has_motion_until(model::Utime utime, double max_wait_s) const {
  const auto newest = now();
  if (!newest) return false;
  if (*newest - utime > microseconds(max_wait_s)) return true;
  const auto has_reached = [&](Sensor sensor) {
    return !is_live(sensor) || *last(sensor) >= utime;
  };
  return has_reached(Sensor::kImu) && has_reached(Sensor::kWheels);
}

void InputGuard::find_silent(std::vector<InputFault>& faults) {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const auto sensor = static_cast<Sensor>(i);
    if (sensor == Sensor::kGnss || states_[i].is_silent) continue;
    if (!has_spoken(sensor) || is_live(sensor)) continue;
    states_[i].is_silent = true;
    faults.push_back({InputFaultKind::kSilent, channel_of(sensor),
                      fmt::format("nothing for {:.2f} s", silent_s(sensor))});
  }
}

}  // namespace understory::lidar_imu_input
