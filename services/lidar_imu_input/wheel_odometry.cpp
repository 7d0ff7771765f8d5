#include "services/lidar_imu_input/wheel_odometry.hpp"

#include <algorithm>
#include <cmath>

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
double axle_speed(const CarGeometry& car, double encoder_speed_mps, double steering_rad) {
  return encoder_speed_mps / (1.0 - std::tan(steering_rad) * car.encoder_left_m / car.wheelbase_m);
}

void WheelOdometry::add(const model::WheelSample& sample) {
  if (!samples_.empty() && sample.utime <= samples_.back().utime) {
    ++out_of_order_;
    return;
  }
  samples_.push_back(sample);
}

geometry::SE2WithCovariance WheelOdometry::step(const model::WheelSample& sample,
                                                double seconds) const {
  const CarGeometry& car = parameters_.car;
  const WheelNoise& noise = parameters_.noise;
  const double speed = axle_speed(car, sample.speed_mps, sample.steering_rad);
  const double curvature_per_m = std::tan(sample.steering_rad) / car.wheelbase_m;

  // Errors with a correlation time tau, acting for seconds << tau, have the power tau * seconds.
  const double power = seconds * noise.correlation_time_s;
  const double slope = (1.0 + square(std::tan(sample.steering_rad))) / car.wheelbase_m;
  const double steering_variance =
      square(noise.steering_sigma_rad) + square(noise.steering_scale_sigma * sample.steering_rad);

  const double along = square(speed * noise.speed_scale_sigma) * power;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  covariance(0, 0) = along + square(noise.standstill_sigma_m) * seconds;
  covariance(1, 1) =
      square(speed * noise.side_slip_sigma) * power + square(noise.standstill_sigma_m) * seconds;
  covariance(2, 2) = square(speed * slope) * steering_variance * power +
                     along * square(curvature_per_m) + square(noise.standstill_sigma_rad) * seconds;
  covariance(0, 2) = along * curvature_per_m;
  covariance(2, 0) = covariance(0, 2);

  return {geometry::SE2::Exp({speed * seconds, 0.0, speed * curvature_per_m * seconds}),
          covariance};
}

std::optional<geometry::SE2WithCovariance> WheelOdometry::integrate(model::Utime from,
                                                                    model::Utime to) {
  // The valid sample at `from` is the last one that is not later.
  while (samples_.size() > 1 && samples_[1].utime <= from) samples_.pop_front();
  if (samples_.empty() || samples_.front().utime > from) return std::nullopt;

  geometry::SE2WithCovariance motion;
  model::Utime at = from;
  for (std::size_t i = 0; i < samples_.size() && at < to; ++i) {
    const bool last = i + 1 == samples_.size();
    const model::Utime until = last ? to : std::min(to, samples_[i + 1].utime);
    if (seconds_between(samples_[i].utime, until) > parameters_.max_gap_s) return std::nullopt;
    motion = compound(motion, step(samples_[i], seconds_between(at, until)));
    at = until;
  }
  // Each end of the interval has the stamps' jitter.
  const Eigen::Vector3d rate = motion.mean.Log() / seconds_between(from, to);
  motion.covariance += 2.0 * square(parameters_.noise.stamp_sigma_s) * rate * rate.transpose();
  return motion;
}

std::optional<model::Odometry> WheelOdometry::advance_to(model::Utime stamp) {
  if (last_stamp_ && stamp <= *last_stamp_) return std::nullopt;
  const std::optional<model::Utime> from = last_stamp_;
  last_stamp_ = stamp;
  if (!from) return std::nullopt;

  const auto motion = integrate(*from, stamp);
  if (!motion) {
    ++without_samples_;
    return std::nullopt;
  }

  model::Odometry odometry;
  odometry.from_utime = *from;
  odometry.utime = stamp;
  odometry.sequence = sequence_++;
  const geometry::SE2& axle_T_vehicle = parameters_.car.axle_T_vehicle;
  const geometry::SE2 vehicle_T_axle = axle_T_vehicle.inverse();
  odometry.from_T_to = vehicle_T_axle * motion->mean * axle_T_vehicle;
  const Eigen::Matrix3d adjoint = vehicle_T_axle.Adjoint();
  odometry.covariance = adjoint * motion->covariance * adjoint.transpose();
  return odometry;
}

}  // namespace understory::lidar_imu_input
