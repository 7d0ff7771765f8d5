#include "services/lidar_imu_input/arrival_order.hpp"

#include <algorithm>
#include <utility>

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

/// A step longer than usual by this factor contains a gap.
constexpr double kGapFactor = 1.5;

bool is_ordered(Sensor sensor) { return sensor != Sensor::kSweep && sensor != Sensor::kGnss; }

std::size_t index_of(Sensor sensor) { return static_cast<std::size_t>(sensor); }

model::Utime stage_stamp(const RawReading& reading, const InputGuard& guard) {
  return guard.on_stage_time(sensor_of(reading), stamp_of(reading));
}

}  // namespace

std::optional<InputFault> ArrivalOrder::add(RawReading reading, const InputGuard& guard) {
  const Sensor sensor = sensor_of(reading);
  const model::Utime end = guard.on_stage_time(sensor, end_of(reading));

  // A stamp that is not trusted must not end the waiting of other sensors.
  if (sensor != Sensor::kGnss && guard.is_believable(end)) {
    newest_ = std::max(end, newest_.value_or(end));
    lasers_[index_of(sensor)] = {end, *newest_ - end};
  }
  if (!is_ordered(sensor)) {
    ready_.push_back(std::move(reading));
    return std::nullopt;
  }

  // Sorted by stamp; at equal stamps the IMU is first.
  const auto key = [&guard](const RawReading& one) {
    return std::pair(stage_stamp(one, guard), sensor_of(one));
  };
  const auto place = std::ranges::upper_bound(
      waiting_, key(reading), {}, [&key](const HeldReading& one) { return key(one.reading); });
  if (place != waiting_.begin() && key(std::prev(place)->reading) == key(reading))
    return InputFault{InputFaultKind::kLate, channel_of(sensor), "a stamp that came before"};
  waiting_.insert(place, HeldReading{std::move(reading)});
  return std::nullopt;
}

std::optional<RawReading> ArrivalOrder::next(const InputGuard& guard, bool everything) {
  const auto take = [this](RawReading reading) {
    sequences_[index_of(sensor_of(reading))] = sequence_of(reading);
    return reading;
  };
  // At the start a sweep does not overtake the first samples of motion.
  const bool starts = !waiting_.empty() && !guard.has_spoken(sensor_of(waiting_.front().reading));
  if (!ready_.empty() && !starts) {
    RawReading reading = std::move(ready_.front());
    ready_.pop_front();
    return take(std::move(reading));
  }
  if (waiting_.empty()) return std::nullopt;
  if (!everything && !may_go(waiting_.front().reading, guard)) return std::nullopt;
  RawReading reading = std::move(waiting_.front().reading);
  waiting_.pop_front();
  return take(std::move(reading));
}

bool ArrivalOrder::may_go(const RawReading& reading, const InputGuard& guard) const {
  const Sensor sensor = sensor_of(reading);
  const model::Utime utime = stage_stamp(reading, guard);
  if (!newest_ || seconds_between(utime, *newest_) >= parameters_.reorder_s) return true;

  // Before the first one others may have been sent.
  const auto last = guard.last(sensor);
  if (!last) return false;
  // Late ones and jumps are left to the guard.
  if (utime <= *last || seconds_between(*last, utime) > guard.longest_step_s(sensor)) return true;

  if (!is_next(reading, *last, guard)) return false;
  if (sensor == Sensor::kScan) return true;
  return !misses_motion(sensor, utime, guard) && !misses_laser(Sensor::kSweep, guard) &&
         !misses_laser(Sensor::kScan, guard);
}

/// Whether no reading is missing between the sensor's previous one and this one.
bool ArrivalOrder::is_next(const RawReading& reading, model::Utime last,
                           const InputGuard& guard) const {
  const Sensor sensor = sensor_of(reading);
  const std::uint64_t sequence = sequence_of(reading);
  if (sequence > 0 && sequence == sequences_[index_of(sensor)] + 1) return true;
  const double period_us = guard.period_us(sensor);
  const auto step_us = static_cast<double>(stage_stamp(reading, guard) - last);
  return period_us == 0.0 || step_us <= kGapFactor * period_us;
}

/// Whether a sample of the other sensor of motion is due before this one. Wheels follow the IMU's
/// nearest sample; the IMU follows the wheels that came half of its period before.
bool ArrivalOrder::misses_motion(Sensor sensor, model::Utime utime, const InputGuard& guard) const {
  const Sensor other = sensor == Sensor::kImu ? Sensor::kWheels : Sensor::kImu;
  const double period_us = guard.period_us(other);
  const double half_us = 0.5 * guard.period_us(Sensor::kImu);
  if (!guard.is_live(other) || period_us == 0.0 || half_us == 0.0) return false;

  const model::Utime last = *guard.last(other);
  const auto ahead_us = static_cast<double>(utime - last);
  const bool is_due = sensor == Sensor::kImu ? ahead_us > period_us + half_us : ahead_us >= half_us;
  if (!is_due) return false;

  // It has arrived, with a later stamp.
  const auto held = std::ranges::find_if(
      waiting_, [other](const HeldReading& one) { return sensor_of(one.reading) == other; });
  return held == waiting_.end() || !is_next(held->reading, last, guard);
}

/// Whether motion is known up to the end of a revolution that has not arrived: later readings wait
/// for it.
bool ArrivalOrder::misses_laser(Sensor laser, const InputGuard& guard) const {
  const Laser& latest = lasers_[index_of(laser)];
  const double period_us = guard.period_us(laser);
  if (!latest.end || period_us == 0.0 || !guard.is_live(laser)) return false;
  // Revolutions that are always later are not waited for.
  if (static_cast<double>(latest.late_us) * 1e-6 > parameters_.reorder_s) return false;
  const model::Utime due = *latest.end + static_cast<model::Utime>(period_us);
  return guard.has_motion_until(due, parameters_.reorder_s);
}

}  // namespace understory::lidar_imu_input
