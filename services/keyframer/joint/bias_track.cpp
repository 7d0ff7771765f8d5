#include "services/keyframer/joint/bias_track.hpp"

#include <cmath>

namespace understory::keyframer::joint {
namespace {

constexpr double kGravity_mps2 = 9.81;
/// Random walks of the bias, as the filter has them.
constexpr double kGyroWalk = 1e-5;           // rad/s/sqrt(s)
constexpr double kAccelerometerWalk = 1e-3;  // m/s^2/sqrt(s)
/// Of an accelerometer's bias before anything is known, the level's error included.
constexpr double kAccelerometer_mps2 = 0.05;
/// Least standard deviation of the gyro's bias: the scale's error on the move.
constexpr double kGyro_rad_s = 1e-4;

double square(double value) { return value * value; }

}  // namespace

BiasEstimate BiasTrack::known(const model::InertialMotion& step,
                              const geometry::SE2WithCovariance& motion) const {
  if (estimate_) return *estimate_;
  const double gyro = motion.covariance(2, 2) / square(step.inertial.seconds);
  const double accelerometer = square(kAccelerometer_mps2);
  return {step.inertial.bias,
          Eigen::Vector3d(gyro + square(kGyro_rad_s), accelerometer, accelerometer).asDiagonal()};
}

void BiasTrack::pass(const model::InertialMotion& step) {
  if (!estimate_) return;
  const double seconds = step.inertial.seconds;
  const Eigen::Matrix2d& level = step.inertial.level.added;
  // An error of roll is felt sideways, one of pitch forward.
  estimate_->covariance.diagonal() +=
      Eigen::Vector3d(square(kGyroWalk) * seconds,
                      square(kAccelerometerWalk) * seconds + square(kGravity_mps2) * level(1, 1),
                      square(kAccelerometerWalk) * seconds + square(kGravity_mps2) * level(0, 0));
}

}  // namespace understory::keyframer::joint
