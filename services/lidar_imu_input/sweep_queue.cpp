#include "services/lidar_imu_input/sweep_queue.hpp"

#include <algorithm>
#include <utility>

#include "services/lidar_imu_input/deskew.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr std::size_t kMostWaiting = 20;
/// Largest change of a sweep's stamp beyond its own end.
constexpr model::Utime kLongestCarry_us = 250'000;

/// A scan taken in one instant is published with its own stamp.
bool can_be_carried(const WaitingSweep& waiting) {
  const auto* scan = std::get_if<model::PlanarScan>(&waiting.item);
  return scan == nullptr || has_beam_times(*scan);
}

}  // namespace

Admission SweepQueue::add(WaitingSweep waiting, std::optional<model::Utime> increment_end) {
  Admission admission;
  if (waiting_.size() >= kMostWaiting) {
    admission.dropped_oldest = true;
    waiting_.pop_front();
  }

  const bool is_scan = std::holds_alternative<model::PlanarScan>(waiting.item);
  if (increment_end && waiting.end < *increment_end) {
    const std::optional<model::Utime>& last = is_scan ? scan_stamp_ : sweep_stamp_;
    const bool too_late =
        *increment_end - waiting.end > kLongestCarry_us || (last && *last >= *increment_end);
    if (too_late || !can_be_carried(waiting)) {
      admission.fault =
          InputFault{InputFaultKind::kLate, channel_of(is_scan ? Sensor::kScan : Sensor::kSweep),
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
  std::optional<model::Utime>& last =
      std::holds_alternative<model::PlanarScan>(waiting.item) ? scan_stamp_ : sweep_stamp_;
  if (last && waiting.end <= *last) return false;
  last = waiting.end;
  return true;
}

}  // namespace understory::lidar_imu_input
