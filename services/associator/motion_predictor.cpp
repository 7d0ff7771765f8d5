#include "services/associator/motion_predictor.hpp"

#include <algorithm>
#include <cmath>

namespace understory::associator {
namespace {

/// Least variance of odometry [m^2, rad^2].
constexpr double kMotionFloor = 1e-8;
constexpr double kMaxPoseAge_s = 1.0;
/// Odometry kept for the comparison of observations (motion_check.hpp).
constexpr model::Utime kOdometryKept_us = 2'000'000;
constexpr model::Utime kGapTolerance_us = 1000;
/// Acceleration [m/s^2] allowed for in a motion at constant velocity.
constexpr double kUnknownAcceleration_mps2 = 3.0;
/// Interval [s] of `motion_sigma_rad`.
constexpr double kNominalInterval_s = 0.1;

double seconds_between(model::Utime from, model::Utime to) {
  return 1e-6 * static_cast<double>(to - from);
}

/// Motion since a pose with known velocity, by the IMU.
struct DeadReckoning {
  model::Utime reached = 0;
  Eigen::Vector2d velocity_mps = Eigen::Vector2d::Zero();  ///< In the axes of the start.
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double yaw_rad = 0.0;

  void add(const model::Preintegration& p, const model::InertialBias& bias) {
    const Eigen::Matrix<double, 5, 1> shift = p.bias_jacobian * (bias - p.bias);
    const Eigen::Matrix2d rotation = geometry::SE2(0.0, 0.0, yaw_rad).rotation();
    position_m += velocity_mps * p.seconds + rotation * (p.position_m + shift.tail<2>());
    velocity_mps += rotation * (p.velocity_mps + shift.segment<2>(1));
    yaw_rad += p.yaw_rad + shift(0);
  }
};

}  // namespace

void MotionPredictor::add(const model::Odometry& increment) {
  if (!increment.from_T_to.coordinates().allFinite() || !increment.covariance.allFinite()) return;
  const model::Utime newest =
      odometry_.increments().empty() ? increment.from_utime : odometry_.increments().back().utime;
  if (increment.utime < newest - kClockJump_us) odometry_ = model::OdometryBuffer();
  odometry_.add(increment);
}

void MotionPredictor::add(const model::EkfPose& pose) {
  if (pose.velocity_mps.allFinite() && pose.bias.allFinite()) filter_pose_ = pose;
}

PredictedMotion MotionPredictor::predict(model::Utime utime) const {
  const auto motion = measured(utime);
  PredictedMotion predicted{motion ? *motion : extrapolated(utime), !motion.has_value()};
  predicted.last_T_now.covariance += kMotionFloor * Eigen::Matrix3d::Identity();
  return predicted;
}

std::optional<geometry::SE2WithCovariance> MotionPredictor::measured(model::Utime utime) const {
  auto motion = odometry_.between(*last_scan_, utime);
  const bool has_wheels = motion && odometry_.increments().back().has_wheels;
  if (has_wheels) return motion;

  // The filter may be wrong: the smaller covariance decides.
  if (auto filtered = by_filter(utime)) {
    if (!motion || filtered->covariance.trace() < motion->covariance.trace()) return filtered;
  }
  return motion;
}

/// The filter's velocity at the last scan, and the IMU since.
std::optional<geometry::SE2WithCovariance> MotionPredictor::by_filter(model::Utime utime) const {
  if (!filter_pose_ || filter_pose_->utime != *last_scan_) return std::nullopt;
  const double duration = seconds_between(*last_scan_, utime);
  if (duration > kMaxPoseAge_s) return std::nullopt;

  // As far as the IMU covers the time without a gap.
  const model::EkfPose& start = *filter_pose_;
  DeadReckoning motion{.reached = *last_scan_, .velocity_mps = start.velocity_mps};
  for (const model::Odometry& increment : odometry_.increments()) {
    if (increment.utime <= motion.reached) continue;
    if (!increment.inertial || increment.from_utime > motion.reached + kGapTolerance_us ||
        increment.utime > utime + kGapTolerance_us)
      break;
    motion.add(*increment.inertial, start.bias);
    motion.reached = increment.utime;
  }

  // The rest of the time at constant velocity.
  const double blind = seconds_between(motion.reached, utime);
  motion.position_m += motion.velocity_mps * blind;
  const double shift_variance = std::pow(0.5 * kUnknownAcceleration_mps2 * blind * blind, 2) +
                                kMotionFloor +
                                start.velocity_covariance.trace() * duration * duration;
  const double rotation_variance =
      std::pow(parameters_.motion_sigma_rad * blind / kNominalInterval_s, 2) + 1e-6;
  return geometry::SE2WithCovariance{
      geometry::SE2(motion.position_m, motion.yaw_rad),
      Eigen::Vector3d(shift_variance, shift_variance, rotation_variance).asDiagonal()};
}

/// Repeats the last motion, in proportion to time.
geometry::SE2WithCovariance MotionPredictor::extrapolated(model::Utime utime) const {
  const double interval = seconds_between(*last_scan_, utime);
  const double stretch = std::max(1.0, interval / last_interval_s_);
  const Eigen::Vector3d sigma(parameters_.motion_sigma_m, parameters_.motion_sigma_m,
                              parameters_.motion_sigma_rad);
  return {geometry::SE2::Exp(interval / last_interval_s_ * last_motion_.Log()),
          (stretch * sigma).cwiseAbs2().asDiagonal()};
}

std::optional<geometry::SE2WithCovariance> MotionPredictor::by_wheels(model::Utime from,
                                                                      model::Utime to) const {
  if (odometry_.increments().empty()) return std::nullopt;
  // Without a gyro the heading is from the steering angle, which is not accurate enough.
  const model::Odometry& latest = odometry_.increments().back();
  if (!latest.has_wheels || !latest.inertial) return std::nullopt;
  return odometry_.between(from, to);
}

void MotionPredictor::set_scan(model::Utime utime, const geometry::SE2& last_T_now) {
  if (last_scan_) {
    last_motion_ = last_T_now;
    last_interval_s_ = seconds_between(*last_scan_, utime);
  }
  last_scan_ = utime;
  odometry_.forget_before(utime - kOdometryKept_us);
}

}  // namespace understory::associator
