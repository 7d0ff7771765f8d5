#include "services/lidar_imu_input/step_back.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

/// Clocks that go back by less were set, and are followed: the vehicle continues at its place.
constexpr double kFarBack_s = 10.0;
constexpr double kStepDoubt_s = 1.0;
/// Readings with larger steps in between have no common time.
constexpr double kTogether_s = 1.5;
/// Gap between the old time and the new one: the filter reports a jump of its pose.
constexpr double kStepGap_s = 2.0;
constexpr std::size_t kMostBehind = 1000;

void move(RawReading& reading, model::Utime by_us) {
  std::visit([by_us](auto& value) { value.utime += by_us; }, reading);
}

}  // namespace

AfterStepBack StepBack::take(RawReading reading, const InputGuard& guard) {
  move(reading, moved_us_);
  const std::optional<model::Utime> now = guard.time();
  const Sensor sensor = sensor_of(reading);
  if (sensor == Sensor::kGnss || !now) return {{std::move(reading)}, {}};

  // The old time continues: the held readings are of one sensor.
  const model::Utime end = guard.on_stage_time(sensor, end_of(reading));
  AfterStepBack after;
  const bool is_apart = !held_.empty() && std::abs(seconds_between(end_of(held_.back()),
                                                                   end_of(reading))) > kTogether_s;
  const bool goes_on = seconds_between(end, *now) <= kFarBack_s;
  if (goes_on || is_apart || held_.size() >= kMostBehind) after.readings = finish();
  if (goes_on) {
    after.readings.push_back(std::move(reading));
    return after;
  }

  held_.push_back(std::move(reading));
  const model::Utime first = end_of(held_.front());
  if (seconds_between(first, end_of(held_.back())) < kStepDoubt_s || !has_all_live(guard))
    return after;

  // After all readings used so far.
  const model::Utime by_us = *now + microseconds(kStepGap_s) - first;
  moved_us_ += by_us;
  for (RawReading& one : held_) move(one, by_us);
  after.back_s = seconds_between(first, *now);
  after.readings = finish();
  return after;
}

std::vector<RawReading> StepBack::finish() { return std::exchange(held_, {}); }

bool StepBack::has_all_live(const InputGuard& guard) const {
  for (const Sensor sensor : {Sensor::kImu, Sensor::kWheels, Sensor::kSweep, Sensor::kScan}) {
    const auto is_of = [sensor](const RawReading& one) { return sensor_of(one) == sensor; };
    if (guard.is_live(sensor) && std::ranges::none_of(held_, is_of)) return false;
  }
  return true;
}

}  // namespace understory::lidar_imu_input
