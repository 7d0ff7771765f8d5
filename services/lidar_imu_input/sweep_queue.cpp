#include "services/lidar_imu_input/sweep_queue.hpp"

#include <algorithm>
#include <utility>

namespace understory::lidar_imu_input {
namespace {

constexpr std::size_t kMostWaiting = 20;
/// A sweep may be carried so far ahead of its own end.
constexpr model::Utime kLongestCarry_us = 250'000;

}  // namespace

Admission SweepQueue::add(WaitingSweep waiting, std::optional<model::Utime> increment_end) {
  Admission admission;
  if (waiting_.size() >= kMostWaiting) {
    admission.dropped_oldest = true;
    waiting_.pop_front();
  }

  const bool is_sweep = std::holds_alternative<model::PointSweep>(waiting.item);
  if (increment_end && waiting.end < *increment_end) {
    const std::optional<model::Utime>& last = is_sweep ? sweep_stamp_ : scan_stamp_;
    const bool too_late =
        *increment_end - waiting.end > kLongestCarry_us || (last && *last >= *increment_end);
    if (too_late || !is_sweep) {
      admission.fault =
          InputFault{InputFaultKind::kLate, channel_of(is_sweep ? Sensor::kSweep : Sensor::kScan),
                     "came after the odometry of its time was published"};
      return admission;
    }
    admission.is_carried = true;
    waiting.end = *increment_end;
  }

  const auto place = std::ranges::upper_bound(waiting_, waiting.end, {}, &WaitingSweep::end);
  waiting_.insert(place, WaitingSweep{waiting.end, std::move(waiting.item)});
  return admission;
}

WaitingSweep SweepQueue::take() {
  WaitingSweep next = std::move(waiting_.front());
  waiting_.pop_front();
  return next;
}

bool SweepQueue::release(const WaitingSweep& waiting) {
  if (std::holds_alternative<LostSweep>(waiting.item)) return false;
  if (std::holds_alternative<model::PlanarScan>(waiting.item)) {
    scan_stamp_ = waiting.end;
    return true;
  }
  if (sweep_stamp_ && waiting.end <= *sweep_stamp_) return false;
  sweep_stamp_ = waiting.end;
  return true;
}

}  // namespace understory::lidar_imu_input
