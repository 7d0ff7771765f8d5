#include "common/model/odometry_buffer.hpp"

#include <algorithm>
#include <cstdlib>

namespace understory::model {
namespace {

/// Rounding of stamps between consecutive increments.
constexpr Utime kGapTolerance_us = 1000;

constexpr std::size_t kMaxIncrements = 20000;

geometry::SE2WithCovariance part(const Odometry& increment, Utime from, Utime to) {
  const double fraction =
      static_cast<double>(to - from) / static_cast<double>(increment.utime - increment.from_utime);
  if (fraction >= 1.0) return {increment.from_T_to, increment.covariance};
  return {geometry::SE2::Exp(fraction * increment.from_T_to.Log()),
          fraction * increment.covariance};
}

}  // namespace

bool OdometryBuffer::add(const Odometry& increment) {
  if (increment.utime <= increment.from_utime) return false;
  if (!increments_.empty() && increment.from_utime < increments_.back().utime - kGapTolerance_us)
    return false;
  increments_.push_back(increment);
  if (increments_.size() > kMaxIncrements) increments_.pop_front();
  return true;
}

std::optional<geometry::SE2WithCovariance> OdometryBuffer::between(Utime from, Utime to) const {
  if (to < from) return std::nullopt;
  auto increment = std::upper_bound(increments_.begin(), increments_.end(), from,
                                    [](Utime t, const Odometry& p) { return t < p.utime; });

  geometry::SE2WithCovariance motion;
  Utime reached = from;
  while (reached + kGapTolerance_us < to || (reached < to && increment != increments_.end())) {
    if (increment == increments_.end() || increment->from_utime > reached + kGapTolerance_us) {
      return std::nullopt;
    }
    const Utime start = std::max(reached, increment->from_utime);
    const Utime end = std::min(to, increment->utime);
    if (end > start) motion = compound(motion, part(*increment, start, end));
    reached = std::max(end, reached + 1);
    ++increment;
  }
  return motion;
}

std::optional<GyroRotation> OdometryBuffer::gyro_rotation(Utime from, Utime to) const {
  GyroRotation sum;
  Utime covered = 0;
  for (const Odometry& increment : increments_) {
    const Utime overlap = std::min(to, increment.utime) - std::max(from, increment.from_utime);
    if (overlap <= 0) continue;
    if (!increment.inertial) return std::nullopt;
    covered += overlap;

    // In proportion to time; at standstill the bias has no effect.
    const double part =
        static_cast<double>(overlap) / static_cast<double>(increment.utime - increment.from_utime);
    const double seconds = increment.is_stationary ? 0.0 : 1e-6 * static_cast<double>(overlap);
    sum += {part * increment.from_T_to.theta(), part * increment.inertial->covariance(0, 0),
            seconds, seconds * increment.inertial->bias.x()};
  }

  if (covered + kGapTolerance_us < to - from) return std::nullopt;
  return sum;
}

void OdometryBuffer::forget_before(Utime utime) {
  while (!increments_.empty() && increments_.front().utime <= utime) increments_.pop_front();
}

}  // namespace understory::model
