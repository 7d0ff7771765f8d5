#include "services/lidar_imu_input/motion_estimator.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace understory::lidar_imu_input {
namespace {

constexpr double kBoundPeriod_s = 10.0;
constexpr double kBiasKnown_s = 3.0;  // of standing
constexpr double kSpeedsKept_s = 5.0;
constexpr double kLeastScaleSigma = 0.003;
constexpr double kStillSigmas = 4.0;    // from zero, that a standing vehicle's velocity may seem
constexpr double kCorrected_s = 2.0;    // for so long the filter's corrections count
constexpr double kInsistence_s = 10.0;  // then a velocity that nothing corrects is thought wrong

double square(double value) { return value * value; }
double seconds_between(model::Utime from, model::Utime to) {
  return static_cast<double>(to - from) * 1e-6;
}
Eigen::Vector3d flat(const Eigen::Vector2d& v) { return {v.x(), v.y(), 0.0}; }

}  // namespace

MotionEstimator::MotionEstimator(const LidarImuInputParameters& parameters)
    : parameters_(parameters),
      reckoning_(parameters.imu),
      standstill_(parameters.standstill),
      wheel_only_(parameters.wheels),
      levels_(parameters.imu.max_gap_s),
      stationary_bias_sigma_(parameters.imu.gyro_bias_sigma) {
  const geometry::SE2 vehicle_T_axle = parameters.wheels.car.axle_T_vehicle.inverse();
  axle_position_m_ = flat(vehicle_T_axle.translation());
  axle_forward_ = flat(vehicle_T_axle.rotation().col(0));
  axle_left_ = flat(vehicle_T_axle.rotation().col(1));
}

model::ImuSample MotionEstimator::to_vehicle(const model::ImuSample& sensor_sample) {
  const Eigen::Quaterniond turn = parameters_.imu.mount.rotation();
  model::ImuSample sample = sensor_sample;
  sample.angular_rate_rad_s = turn * sensor_sample.angular_rate_rad_s;
  sample.specific_force_mps2 = turn * sensor_sample.specific_force_mps2;
  // Differences of the rate telescope in the integral: their noise does not add up. Over some
  // samples they are less noisy still.
  const Eigen::Vector3d lever = parameters_.imu.mount.position_m();
  const Eigen::Vector3d& rate = sample.angular_rate_rad_s;
  Eigen::Vector3d lever_force = rate.cross(rate.cross(lever));
  if (!raw_.empty() && seconds_between(raw_.back().utime, sample.utime) > parameters_.imu.max_gap_s)
    raw_.clear();
  raw_.push_back(sample);
  while (raw_.size() > 2 && seconds_between(raw_[1].utime, sample.utime) >= kLeverBaseline_s)
    raw_.pop_front();
  const double seconds = seconds_between(raw_.front().utime, sample.utime);
  if (seconds > 0.0) lever_force += (rate - raw_.front().angular_rate_rad_s).cross(lever) / seconds;
  sample.specific_force_mps2 -= lever_force;
  return sample;
}

void MotionEstimator::begin(model::Utime utime) { wheel_only_.advance_to(utime); }

void MotionEstimator::start(const model::ImuSample& sample) {
  attitude_.emplace(parameters_.imu, sample.specific_force_mps2);
  latest_level_ = level(sample, false);
  levels_.add(*latest_level_);
  moved_utime_ = sample.utime;
}

void MotionEstimator::add_imu(const model::ImuSample& sample, bool is_saturated) {
  if (!attitude_) {
    start(sample);
  } else {
    const double seconds = seconds_between(latest_->utime, sample.utime);
    if (seconds > parameters_.imu.max_gap_s) {
      bridge_gap(sample);
    } else {
      propagate(sample, is_saturated, seconds);
    }
  }
  latest_ = sample;
  pose_utime_ = std::max(sample.utime, pose_utime_.value_or(sample.utime));
  use_correction(sample.utime);
  remember(sample);
}

void MotionEstimator::propagate(const model::ImuSample& sample, bool is_saturated, double seconds) {
  attitude_->propagate(0.5 * (latest_->angular_rate_rad_s + sample.angular_rate_rad_s),
                       0.5 * (latest_->specific_force_mps2 + sample.specific_force_mps2), seconds,
                       is_saturated);
  stationary_bias_sigma_ =
      std::sqrt(square(stationary_bias_sigma_) + square(parameters_.imu.gyro_bias_walk) * seconds);
  const bool bias_known = standstill_.longest_s() > kBiasKnown_s &&
                          stationary_bias_sigma_ < 0.02 * parameters_.standstill.gyro_mean_rad_s;
  standstill_.add(raw_.back(), bias_known ? std::optional(attitude_->gyro_bias()) : std::nullopt,
                  velocity_allows_stationary(sample.utime));
  if (standstill_.is_stationary()) {
    use_standstill(sample, seconds);
  } else {
    moved_utime_ = sample.utime;
  }
  const LevelSample levelled = level(sample, is_saturated);
  reckoning_.propagate(*latest_level_, levelled);
  const double rise = (attitude_->level_Q_vehicle() * attitude_->velocity()).z();
  height_m_ += rise * seconds;
  levels_.add(levelled);
  latest_level_ = levelled;
  if (!standstill_.is_stationary()) use_constraints(sample);
}

void MotionEstimator::bridge_gap(const model::ImuSample& sample) {
  const double seconds = seconds_between(latest_->utime, sample.utime);
  attitude_->bridge(seconds);
  standstill_.reset();
  moved_utime_ = sample.utime;
  // What the wheels have not told goes on as it was.
  const double open = std::max(0.0, seconds_between(*pose_utime_, sample.utime));
  const Eigen::Vector2d& v = reckoning_.velocity();
  const double rate = latest_level_->yaw_rate_rad_s - stationary_bias_;
  geometry::SE2WithCovariance motion{geometry::SE2::Exp({v.x() * open, v.y() * open, rate * open}),
                                     Eigen::Matrix3d::Zero()};
  motion.covariance.diagonal() << square(open), square(open), square(0.2 * open);
  reckoning_.bridge(motion);
  latest_level_ = level(sample, false);
  levels_.add(*latest_level_);
}

void MotionEstimator::use_standstill(const model::ImuSample& sample, double seconds) {
  const double sigma = parameters_.standstill.velocity_sigma_mps;
  attitude_->add_standstill(sample.angular_rate_rad_s, seconds, sigma);
  // The bias of the heading's rate: what the filter has learned while standing, nothing else.
  const Eigen::Vector3d down = attitude_->level_Q_vehicle().conjugate() * Eigen::Vector3d::UnitZ();
  stationary_bias_ = down.dot(attitude_->gyro_bias());
  stationary_bias_sigma_ = std::sqrt(down.dot(attitude_->gyro_bias_covariance() * down));
  reckoning_.set_gyro_bias(stationary_bias_, stationary_bias_sigma_);
  reckoning_.add_standstill(sigma);
}

void MotionEstimator::use_constraints(const model::ImuSample& sample) {
  const ConstraintParameters& p = parameters_.constraint;
  if (seconds_between(constrained_utime_, sample.utime) < p.period_s) return;
  constrained_utime_ = sample.utime;
  const Eigen::Vector3d rate = sample.angular_rate_rad_s - attitude_->gyro_bias();
  const Eigen::Vector3d axle = attitude_->velocity() + rate.cross(axle_position_m_);
  const double speed = std::abs(axle.dot(axle_forward_));
  if (p.nonholonomic) {
    const double side = std::hypot(p.side_slip_mps, p.side_slip_scale * speed);
    const double vertical = std::hypot(p.vertical_mps, p.vertical_scale * speed);
    attitude_->add_velocity(axle_left_, axle_position_m_, -axle.dot(axle_left_), side);
    attitude_->add_velocity(Eigen::Vector3d::UnitZ(), axle_position_m_, -axle.z(), vertical);
    const Eigen::Vector2d at = axle_position_m_.head<2>();
    const Eigen::Vector2d left = axle_left_.head<2>();
    const double yaw_rate = latest_level_->yaw_rate_rad_s - reckoning_.bias()(0);
    const double slip = left.dot(reckoning_.velocity() + yaw_rate * geometry::perpendicular(at));
    reckoning_.add_velocity(left, at, -slip, side);
  }
  if (!wheels_are_fresh(sample.utime) &&
      seconds_between(bounded_utime_, sample.utime) > kBoundPeriod_s) {
    bounded_utime_ = sample.utime;
    for (const Eigen::Vector3d& direction : {axle_forward_, axle_left_})
      attitude_->add_velocity(direction, Eigen::Vector3d::Zero(),
                              -direction.dot(attitude_->velocity()), p.typical_speed_mps);
  }
}

/// Without wheels standing is told by quiet samples alone, and a smooth road is quiet too: there
/// the velocity that the filter corrects by its landmarks must agree.
bool MotionEstimator::velocity_allows_stationary(model::Utime now) {
  const double slow = parameters_.standstill.wheel_speed_mps;
  const Eigen::Matrix2d spread =
      reckoning_.velocity_covariance() + square(slow) * Eigen::Matrix2d::Identity();
  const Eigen::Vector2d& velocity = reckoning_.velocity();
  const bool agrees = velocity.dot(spread.inverse() * velocity) <= square(kStillSigmas);
  if (agrees || wheels_are_fresh(now)) {
    denied_since_.reset();
    return true;
  }
  denied_since_ = denied_since_.value_or(now);
  return seconds_between(corrected_utime_, now) > kCorrected_s &&
         seconds_between(*denied_since_, now) > kInsistence_s;
}

bool MotionEstimator::wheels_are_fresh(model::Utime now) const {
  return !speeds_.empty() &&
         seconds_between(speeds_.back().utime, now) < parameters_.wheels.max_gap_s;
}

void MotionEstimator::add_wheels(const model::WheelSample& sample) {
  wheel_only_.add(sample);
  standstill_.add_wheel_speed(sample.utime, sample.speed_mps);
  const CarGeometry& car = parameters_.wheels.car;
  const auto then = history_.at(sample.utime);
  // A wheel left of the middle is slower in a left turn.
  const double speed = then ? sample.speed_mps + then->rate_rad_s.z() * car.encoder_left_m
                            : axle_speed(car, sample.speed_mps, sample.steering_rad);
  // The scale that IMU and wheels together tell; never less certain than what is said of it.
  const double known = parameters_.wheels.noise.speed_scale_sigma;
  if (attitude_) {
    const double sigma = std::max(kLeastScaleSigma, 1.5 * attitude_->wheel_scale_sigma());
    speeds_.push_back({sample.utime, speed / attitude_->wheel_scale(), std::min(known, sigma)});
  } else {
    speeds_.push_back({sample.utime, speed, known});
  }
  while (seconds_between(speeds_.front().utime, sample.utime) > kSpeedsKept_s) speeds_.pop_front();
  if (!attitude_ || !then || standstill_.is_stationary()) return;

  const double sigma = parameters_.constraint.wheel_sigma_mps;
  const Eigen::Vector3d axle = then->velocity_mps + then->rate_rad_s.cross(axle_position_m_);
  attitude_->add_wheel_speed(axle_forward_, axle_position_m_, axle.dot(axle_forward_), speed,
                             sigma);
  const Eigen::Vector2d at = axle_position_m_.head<2>();
  const Eigen::Vector2d forward = axle_forward_.head<2>();
  const double thought =
      forward.dot(then->level_velocity_mps + then->rate_rad_s.z() * geometry::perpendicular(at));
  const double slope = latest_level_ ? latest_level_->pitch_cosine : 1.0;
  const double scaled = std::hypot(sigma, speeds_.back().scale_sigma * speed);
  reckoning_.add_velocity(forward, at, speeds_.back().speed_mps * slope - thought, scaled);
}

void MotionEstimator::add_gnss(const model::GnssFix& fix) {
  if (!parameters_.gnss_aided) return;
  const auto then = history_.at(fix.utime);
  if (!then) return;
  const auto reference = reference_.add(fix, then->heading_rad);
  if (!reference) return;
  const Eigen::Vector2d level = geometry::SE2(0.0, 0.0, then->heading_rad).rotation().transpose() *
                                reference->odom_velocity_mps;
  for (int axis = 0; axis < 2; ++axis)
    reckoning_.add_velocity(Eigen::Vector2d::Unit(axis), Eigen::Vector2d::Zero(),
                            level(axis) - then->level_velocity_mps(axis), reference->sigma_mps);
  if (reference->heading_rad)
    reckoning_.add_heading(geometry::wrap_angle(*reference->heading_rad - then->heading_rad),
                           reference->heading_sigma_rad);
}

bool MotionEstimator::add_correction(const model::VelocityCorrection& correction) {
  const auto delay = static_cast<model::Utime>(parameters_.output.correction_delay_s * 1e6);
  corrections_.push_back(correction);
  return !latest_ || latest_->utime < correction.utime + delay;
}

void MotionEstimator::use_correction(model::Utime now) {
  const auto delay = static_cast<model::Utime>(parameters_.output.correction_delay_s * 1e6);
  while (!corrections_.empty() && corrections_.front().utime + delay <= now) {
    const model::VelocityCorrection correction = corrections_.front();
    corrections_.pop_front();
    if (parameters_.gnss_aided) continue;
    const auto then = history_.at(correction.utime);
    if (!then) continue;
    reckoning_.correct(correction, then->level_velocity_mps, then->heading_rad);
    corrected_utime_ = now;
  }
}

LevelSample MotionEstimator::level(const model::ImuSample& sample, bool is_saturated) const {
  const Eigen::Quaterniond level_Q_vehicle = attitude_->level_Q_vehicle();
  const RollPitchYaw angles = roll_pitch_yaw(level_Q_vehicle);
  const Eigen::Vector3d& bias = attitude_->gyro_bias();
  const Eigen::Vector3d& rate = sample.angular_rate_rad_s;
  LevelSample result;
  result.utime = sample.utime;
  // Rate of the heading; the bias about z stays in, for `InertialBias`.
  result.yaw_rate_rad_s =
      (std::sin(angles.roll_rad) * (rate.y() - bias.y()) + std::cos(angles.roll_rad) * rate.z()) /
      std::cos(angles.pitch_rad);
  result.force_mps2 = (level_Q_vehicle * sample.specific_force_mps2).head<2>();
  result.pitch_cosine = std::cos(angles.pitch_rad);
  result.is_saturated = is_saturated;
  return result;
}

void MotionEstimator::remember(const model::ImuSample& sample) {
  if (!history_.empty() && history_.newest().utime >= sample.utime) return;
  MotionState state;
  state.utime = sample.utime;
  state.heading_rad = reckoning_.pose().theta();
  state.odom_Q_vehicle =
      Eigen::Quaterniond(Eigen::AngleAxisd(state.heading_rad, Eigen::Vector3d::UnitZ())) *
      attitude_->level_Q_vehicle();
  state.position_m << reckoning_.pose().translation(), height_m_;
  state.velocity_mps = attitude_->velocity();
  state.level_velocity_mps = reckoning_.velocity();
  state.rate_rad_s = sample.angular_rate_rad_s - attitude_->gyro_bias();
  state.tilt_covariance = attitude_->tilt_covariance();
  history_.add(state);
}

model::RawPose MotionEstimator::raw_pose() const {
  model::RawPose pose;
  pose.utime = pose_utime_.value_or(0);
  pose.odom_T_vehicle = reckoning_.pose();
  pose.covariance = reckoning_.pose_covariance();
  pose.is_reference = parameters_.gnss_aided;
  return pose;
}

}  // namespace understory::lidar_imu_input
