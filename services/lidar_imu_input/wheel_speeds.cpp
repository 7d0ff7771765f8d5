#include "services/lidar_imu_input/wheel_speeds.hpp"

#include <algorithm>

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr double kSpeedsKept_s = 5.0;
constexpr double kLeastScaleSigma = 0.003;

}  // namespace

SpeedSample WheelSpeeds::corrected(model::Utime utime, double measured_mps,
                                   const std::optional<WheelScale>& scale) const {
  const double known = wheels_.noise.speed_scale_sigma;
  if (!scale) return {utime, measured_mps, known};
  const double sigma = std::max(kLeastScaleSigma, 1.5 * scale->sigma);
  return {utime, measured_mps / scale->measured_over_true, std::min(known, sigma)};
}

void WheelSpeeds::add(const SpeedSample& speed) {
  speeds_.push_back(speed);
  while (seconds_between(speeds_.front().utime, speed.utime) > kSpeedsKept_s) speeds_.pop_front();
}

bool WheelSpeeds::are_fresh(model::Utime now) const {
  return !speeds_.empty() && seconds_between(speeds_.back().utime, now) < wheels_.max_gap_s;
}

bool WheelSpeeds::cover(model::Utime from, model::Utime to) const {
  if (speeds_.empty() || speeds_.front().utime > from) return false;
  model::Utime reached = speeds_.front().utime;
  for (const SpeedSample& sample : speeds_) {
    if (sample.utime > from &&
        seconds_between(std::max(reached, from), sample.utime) > wheels_.max_gap_s)
      return reached >= to;
    reached = sample.utime;
    if (reached >= to) return true;
  }
  return seconds_between(reached, to) <= wheels_.max_gap_s;
}

double WheelSpeeds::at(model::Utime utime) const {
  const auto after = std::ranges::lower_bound(speeds_, utime, {}, &SpeedSample::utime);
  if (after == speeds_.end()) return speeds_.back().speed_mps;
  if (after == speeds_.begin() || after->utime == utime) return after->speed_mps;
  const auto before = std::prev(after);
  const double share =
      seconds_between(before->utime, utime) / seconds_between(before->utime, after->utime);
  return before->speed_mps + share * (after->speed_mps - before->speed_mps);
}

}  // namespace understory::lidar_imu_input
