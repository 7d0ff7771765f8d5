#include "services/keyframer/joint/bias_track.hpp"

#include <cmath>

#include "common/model/preintegration.hpp"

namespace understory::keyframer::joint {
namespace {

/// Random walk of the gyro's bias, as in the filter [rad/s/sqrt(s)].
constexpr double kGyroWalk = 1e-5;
/// Least standard deviation of the gyro's bias: the gyro's scale error in motion.
constexpr double kGyro_rad_s = 1e-4;

double square(double value) { return value * value; }

}  // namespace

BiasEstimate BiasTrack::known(const model::InertialMotion& step,
                              const geometry::SE2WithCovariance& motion) const {
  if (estimate_) return *estimate_;
  const double gyro = motion.covariance(2, 2) / square(step.inertial.seconds);
  const double accelerometer = square(model::kUnknownAccelerometerBias_mps2);
  return {step.inertial.bias,
          Eigen::Vector3d(gyro + square(kGyro_rad_s), accelerometer, accelerometer).asDiagonal()};
}

void BiasTrack::pass(const model::InertialMotion& step) {
  if (!estimate_) return;
  auto variances = estimate_->covariance.diagonal();
  variances.x() += square(kGyroWalk) * step.inertial.seconds;
  variances.tail<2>() += model::added_accelerometer_bias(step.inertial);
}

}  // namespace understory::keyframer::joint
