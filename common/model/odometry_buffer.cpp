#include "common/model/odometry_buffer.hpp"

#include <algorithm>
#include <cstdlib>

#include "common/model/preintegration.hpp"

namespace understory::model {
namespace {

/// Rounding of stamps between consecutive increments.
constexpr Utime kGapTolerance_us = 1000;

/// Correlation time tau of the error of the filter's velocity: its power is tau * dt when
/// increments are compounded.
constexpr double kVelocityCorrelation_s = 0.5;
constexpr std::size_t kMaxIncrements = 20000;

bool begins_at(const Odometry& increment, Utime utime) {
  return std::abs(increment.from_utime - utime) <= kGapTolerance_us;
}

/// The increment's samples with the filter's accelerometer bias; the gyro's bias stays.
Preintegration inertial_of(const Odometry& increment, const VelocityEstimate& start) {
  InertialBias bias = start.bias;
  bias.x() = increment.inertial->bias.x();
  return at_bias(*increment.inertial, bias);
}

/// The increment's translation from the given start velocity; the rotation stays.
geometry::SE2WithCovariance motion_from(const VelocityEstimate& start, const Odometry& increment,
                                        const Preintegration& inertial) {
  const double dt = inertial.seconds;
  geometry::SE2WithCovariance motion;
  motion.mean =
      geometry::SE2(start.velocity_mps * dt + inertial.position_m, increment.from_T_to.theta());

  // The noise of the IMU and of the starting velocity, in the axes of the end.
  const Eigen::Matrix2d back = motion.mean.rotation().transpose();
  const Eigen::Matrix2d of_start =
      OdometryBuffer::kInflation * dt * std::max(dt, kVelocityCorrelation_s) * start.covariance;
  motion.covariance(2, 2) = increment.covariance(2, 2);
  motion.covariance.topLeftCorner<2, 2>() =
      back * (of_start + inertial.covariance.bottomRightCorner<2, 2>()) * back.transpose();
  return motion;
}

/// The velocity at the increment's end.
VelocityEstimate carried_over(const VelocityEstimate& start, const Odometry& increment) {
  const Preintegration inertial = inertial_of(increment, start);
  const Eigen::Matrix2d back = geometry::SE2(0.0, 0.0, inertial.yaw_rad).rotation().transpose();
  VelocityEstimate end = start;
  end.utime = increment.utime;
  end.velocity_mps = back * (start.velocity_mps + inertial.velocity_mps);
  end.covariance =
      back * (start.covariance + inertial.covariance.block<2, 2>(1, 1)) * back.transpose();
  return end;
}

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
  if (velocity_) start_at_velocity(increments_.back());
  if (increments_.size() > kMaxIncrements) increments_.pop_front();
  return true;
}

void OdometryBuffer::start_at_velocity(Odometry& increment) {
  if (!increment.inertial || !begins_at(increment, velocity_->utime)) {
    velocity_.reset();
    return;
  }

  if (!increment.has_wheels && !increment.is_stationary) {
    const auto motion = motion_from(*velocity_, increment, inertial_of(increment, *velocity_));
    const auto spread = [](const Eigen::Matrix3d& c) { return c(0, 0) + c(1, 1); };
    if (spread(motion.covariance) < spread(increment.covariance)) {
      increment.from_T_to = motion.mean;
      increment.covariance = motion.covariance;
    }
  }
  velocity_ = carried_over(*velocity_, increment);
}

void OdometryBuffer::set_filter_velocity(const EkfPose& pose) {
  VelocityEstimate known{pose.utime, pose.velocity_mps, pose.velocity_covariance, pose.bias};

  // The pose may be older than the latest increments: its velocity is propagated over them.
  auto increment = std::find_if(increments_.begin(), increments_.end(), [&](const Odometry& one) {
    return one.utime > known.utime + kGapTolerance_us;
  });
  for (; increment != increments_.end(); ++increment) {
    if (!increment->inertial || !begins_at(*increment, known.utime)) return;
    known = carried_over(known, *increment);
  }
  velocity_ = known;
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

    // Proportional to time; while stationary the bias has no effect.
    const double part =
        static_cast<double>(overlap) / static_cast<double>(increment.utime - increment.from_utime);
    const double seconds = increment.is_stationary ? 0.0 : 1e-6 * static_cast<double>(overlap);
    sum += {part * increment.from_T_to.theta(), part * increment.inertial->covariance(0, 0),
            seconds, seconds * increment.inertial->bias.x()};
  }

  if (covered + kGapTolerance_us < to - from) return std::nullopt;
  return sum;
}

std::optional<InertialMotion> OdometryBuffer::inertial(Utime from, Utime to) const {
  std::optional<InertialMotion> motion;
  Utime reached = from;
  for (const Odometry& increment : increments_) {
    if (increment.utime <= from + kGapTolerance_us) continue;
    if (reached + kGapTolerance_us >= to) break;
    if (!increment.inertial || !begins_at(increment, reached)) return std::nullopt;

    if (!motion) {
      motion = InertialMotion{*increment.inertial, increment.is_stationary};
    } else {
      motion->inertial = compound(motion->inertial, *increment.inertial);
      motion->is_stationary = motion->is_stationary && increment.is_stationary;
    }
    reached = increment.utime;
  }
  if (std::abs(reached - to) > kGapTolerance_us) return std::nullopt;
  return motion;
}

void OdometryBuffer::forget_before(Utime utime) {
  while (!increments_.empty() && increments_.front().utime <= utime) increments_.pop_front();
}

}  // namespace understory::model
