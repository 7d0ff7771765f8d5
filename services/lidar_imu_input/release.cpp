// The part of LidarImuInput that decides when pieces of odometry end and sweeps go out.
#include <algorithm>
#include <cmath>
#include <utility>

#include "services/lidar_imu_input/deskew.hpp"
#include "services/lidar_imu_input/lidar_imu_input.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr std::size_t kMostWaiting = 20;
/// A sweep may be carried so far ahead of its own end.
constexpr model::Utime kLongestCarry_us = 250'000;

model::Utime microseconds(double seconds) {
  return static_cast<model::Utime>(std::llround(seconds * 1e6));
}

}  // namespace

void LidarImuInput::wait(model::Utime end,
                         std::variant<LostSweep, model::PointSweep, model::PlanarScan> item,
                         InputResults& out) {
  if (waiting_.size() >= kMostWaiting) {
    ++counters_.sweeps_dropped;
    waiting_.pop_front();
  }
  const bool is_sweep = std::holds_alternative<model::PointSweep>(item);
  // A piece that has ended is not taken back: what comes behind its end is carried to it.
  if (increment_end_ && end < *increment_end_) {
    const std::optional<model::Utime>& last = is_sweep ? sweep_stamp_ : scan_stamp_;
    const bool too_late =
        *increment_end_ - end > kLongestCarry_us || (last && *last >= *increment_end_);
    if (too_late || !is_sweep) {
      ++counters_.sweeps_dropped;
      out.emplace_back(InputFault{InputFaultKind::kLate,
                                  channel_of(is_sweep ? Sensor::kSweep : Sensor::kScan),
                                  "came after the motion of its time was given away"});
      return;
    }
    ++counters_.sweeps_carried;
    end = *increment_end_;
  }
  const auto place = std::ranges::upper_bound(waiting_, end, {}, &Waiting::end);
  waiting_.insert(place, Waiting{end, std::move(item)});
}

bool LidarImuInput::is_reached(model::Utime utime) const {
  const auto now = guard_.now();
  if (!now) return false;
  if (*now - utime > microseconds(parameters_.output.max_wait_s)) return true;
  const auto reached = [&](Sensor sensor) {
    return !guard_.is_live(sensor) || *guard_.last(sensor) >= utime;
  };
  return reached(Sensor::kImu) && reached(Sensor::kWheels);
}

void LidarImuInput::settle(InputResults& out, bool everything) {
  std::vector<InputFault> faults;
  guard_.find_silent(faults);
  report(faults, out);
  const model::Utime longest = microseconds(parameters_.output.max_increment_s);
  const model::Utime lag = microseconds(parameters_.output.lag_s);
  while (true) {
    const auto now = guard_.now();
    const bool has_item = !waiting_.empty();
    const bool moves = guard_.has_spoken(Sensor::kImu) || guard_.has_spoken(Sensor::kWheels);
    // A piece ends without a sweep where none can come any more for its time, or the next is far.
    const bool near =
        has_item && increment_end_ && 2 * (waiting_.front().end - *increment_end_) <= 3 * longest;
    const bool regular = now && moves && increment_end_ && !near &&
                         (has_item || *now >= *increment_end_ + longest + lag);
    if (regular) {
      if (!everything && !is_reached(*increment_end_ + longest)) return;
      end_increment(*increment_end_ + longest, out);
    } else if (has_item) {
      if (!everything && !is_reached(waiting_.front().end)) return;
      Waiting next = std::move(waiting_.front());
      waiting_.pop_front();
      end_increment(next.end, out);
      release(std::move(next), out);
    } else {
      if (now && moves && !increment_end_) end_increment(*now, out);
      return;
    }
  }
}

void LidarImuInput::end_increment(model::Utime utime, InputResults& out) {
  if (!increment_end_) {
    motion_.begin(utime);
    increment_end_ = utime;
    return;
  }
  if (utime <= *increment_end_) return;
  if (auto increment = motion_.increment(*increment_end_, utime)) {
    out.emplace_back(*std::move(increment));
    publish_raw_pose(true, out);
  } else {
    ++counters_.pieces_missing;
  }
  increment_end_ = utime;
}

void LidarImuInput::release(Waiting waiting, InputResults& out) {
  if (std::holds_alternative<LostSweep>(waiting.item)) {
    ++counters_.sweeps_dropped;
    return;
  }
  if (auto* scan = std::get_if<model::PlanarScan>(&waiting.item)) {
    scan_stamp_ = waiting.end;
    out.emplace_back(std::move(*scan));
    return;
  }
  release_sweep(std::get<model::PointSweep>(std::move(waiting.item)), waiting.end, out);
}

void LidarImuInput::release_sweep(model::PointSweep raw, model::Utime stamp, InputResults& out) {
  if (sweep_stamp_ && stamp <= *sweep_stamp_) {
    ++counters_.sweeps_dropped;
    return;
  }
  sweep_stamp_ = stamp;
  const bool has_times = raw.has_times;
  MotionHistory by_filter;
  if (!motion_.history().at(stamp)) {
    if (const auto motion = filter_motion_.at(stamp)) by_filter.add(*motion);
  }
  const MotionHistory& history = by_filter.empty() ? motion_.history() : by_filter;
  DeskewedSweep result = deskew(std::move(raw), stamp, history, parameters_.lidar.mount);
  if (!by_filter.empty() && result.had_motion) ++counters_.sweeps_by_filter;
  if (!motion_.has_attitude()) result.sweep.attitude.reset();
  ++counters_.sweeps;
  if (!result.had_motion) {
    ++counters_.sweeps_not_deskewed;
    if (has_times)
      out.emplace_back(InputFault{InputFaultKind::kNoMotion, channel_of(Sensor::kSweep),
                                  "no motion is known for the turn: not de-skewed"});
  }
  out.emplace_back(std::move(result.sweep));
}

}  // namespace understory::lidar_imu_input
