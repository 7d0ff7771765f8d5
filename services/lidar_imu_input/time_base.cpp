#include "services/lidar_imu_input/time_base.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr std::size_t kMostHeld = 1000;
/// Largest step of a single sensor, at the start.
constexpr double kLongestFirstStep_s = 10.0;
/// Time for which one sensor must continue alone until the silence of the others counts as a pause.
constexpr double kLongestDoubt_s = 1.0;
/// Readings held within this time belong together.
constexpr double kSameTime_s = 1.5;

model::Utime stage_end(const RawReading& reading, const InputGuard& guard) {
  return guard.on_stage_time(sensor_of(reading), end_of(reading));
}

}  // namespace

BelievedReadings TimeBase::take(RawReading reading, InputGuard& guard,
                                std::vector<InputFault>& faults) {
  const std::optional<model::Utime> now = guard.time();
  const bool proves = sensor_of(reading) != Sensor::kGnss;
  if (now && !(proves && is_ahead(reading, guard))) {
    // The old time continues: the held readings are of a clock that jumped.
    BelievedReadings believed;
    if (proves && stage_end(reading, guard) > *now) believed.readings = finish();
    believed.readings.push_back(std::move(reading));
    return believed;
  }

  held_.push_back({std::move(reading)});
  if (held_.size() > kMostHeld) held_.pop_front();
  if (!proves || !is_proven(guard)) return {};
  return go_on(guard, faults);
}

std::vector<RawReading> TimeBase::finish() {
  std::vector<RawReading> readings;
  for (HeldReading& held : held_) readings.push_back(std::move(held.reading));
  held_.clear();
  return readings;
}

bool TimeBase::is_ahead(const RawReading& reading, const InputGuard& guard) const {
  return seconds_between(*guard.time(), stage_end(reading, guard)) >
         guard.longest_step_s(sensor_of(reading));
}

/// Number of the newest reading's sensor's readings, evenly spaced up to it.
int TimeBase::evenly_before_newest(const InputGuard& guard, double longest_step_s) const {
  const Sensor sensor = sensor_of(held_.back().reading);
  int count = 0;
  model::Utime after = stage_end(held_.back().reading, guard);
  for (auto held = std::next(held_.rbegin()); held != held_.rend(); ++held) {
    if (sensor_of(held->reading) != sensor) continue;
    const model::Utime before = stage_end(held->reading, guard);
    const double step_s = seconds_between(before, after);
    if (step_s <= 0.0 || step_s > longest_step_s) break;
    ++count;
    after = before;
  }
  return count;
}

bool TimeBase::is_proven(const InputGuard& guard) const {
  const RawReading& newest = held_.back().reading;
  const Sensor sensor = sensor_of(newest);
  const model::Utime end = stage_end(newest, guard);

  // Does another sensor agree or contradict?
  bool is_contested = false;
  model::Utime first = end;
  for (const HeldReading& held : held_) {
    const Sensor other = sensor_of(held.reading);
    const model::Utime other_end = stage_end(held.reading, guard);
    if (other == sensor) first = std::min(first, other_end);
    if (other == sensor || other == Sensor::kGnss) continue;
    if (std::abs(seconds_between(other_end, end)) <= parameters_.clock_jump_s) return true;
    is_contested = true;
  }

  // A single sensor.
  if (!guard.time()) {
    const int enough = is_contested ? parameters_.resync_samples : 1;
    return evenly_before_newest(guard, parameters_.clock_jump_s) >= enough ||
           evenly_before_newest(guard, kLongestFirstStep_s) >= parameters_.resync_samples;
  }
  const int evenly = evenly_before_newest(guard, guard.longest_step_s(sensor));
  const bool is_alone = !guard.has_others(sensor);
  return evenly >= 1 && (is_alone || seconds_between(first, end) >= kLongestDoubt_s);
}

/// The newest held reading is correct: the readings that agree with it are used.
BelievedReadings TimeBase::go_on(InputGuard& guard, std::vector<InputFault>& faults) {
  const model::Utime end = stage_end(held_.back().reading, guard);
  // A single slow sensor has needed its time.
  const Sensor sensor = sensor_of(held_.back().reading);
  const bool is_alone = std::ranges::all_of(held_, [sensor](const HeldReading& held) {
    return sensor_of(held.reading) == sensor || sensor_of(held.reading) == Sensor::kGnss;
  });
  const bool is_slow = is_alone && evenly_before_newest(guard, parameters_.clock_jump_s) == 0;
  const int slow_steps = is_slow ? evenly_before_newest(guard, kLongestFirstStep_s) : 0;
  const double same_time_s = kSameTime_s + slow_steps * kLongestFirstStep_s;

  BelievedReadings believed;
  model::Utime first = end;
  for (RawReading& reading : finish()) {
    const double off_s = seconds_between(end, stage_end(reading, guard));
    if (sensor_of(reading) != Sensor::kGnss && std::abs(off_s) > same_time_s) {
      faults.push_back({InputFaultKind::kClockJump, channel_of(sensor_of(reading)),
                        fmt::format("a stamp {:+.3f} s off the others: left out", off_s)});
      continue;
    }
    if (sensor_of(reading) != Sensor::kGnss) first = std::min(first, stage_end(reading, guard));
    believed.readings.push_back(std::move(reading));
  }
  if (guard.now()) believed.pause_s = seconds_between(*guard.now(), first);
  guard.go_on_at(first);
  return believed;
}

/// Sweeps that waited when the state was saved have lost their points.
void TimeBase::drop_lost() {
  std::erase_if(held_, [](const HeldReading& held) {
    return std::holds_alternative<model::PointSweep>(held.reading);
  });
}

}  // namespace understory::lidar_imu_input
