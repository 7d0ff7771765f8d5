#include "services/keyframer/joint/motion_difference.hpp"

namespace understory::keyframer::joint {
namespace {

/// Error of a comparison outside both covariances, as a share of translation or rotation: slip,
/// levelling.
constexpr double kModelShare = 0.01;
/// Likewise of a rotation [rad]: levelling, the bias's walk.
constexpr double kTurnModel_rad = 5e-4;

double squared(double x) { return x * x; }

}  // namespace

WayDifference way_difference(const TwoMotions& motions) {
  const Eigen::Vector2d way = motions.by_odometry.mean.translation();
  const Eigen::Matrix2d rotation = motions.by_odometry.mean.rotation();
  const Eigen::Matrix3d sum = motions.by_landmarks.covariance + motions.by_odometry.covariance;
  WayDifference result;
  result.value_m = motions.by_landmarks.mean.translation() - way;
  result.covariance_m2 = rotation * sum.topLeftCorner<2, 2>() * rotation.transpose() +
                         squared(kModelShare) * way.squaredNorm() * Eigen::Matrix2d::Identity();
  result.jacobian.setZero();
  result.jacobian.col(kYaw) = geometry::perpendicular(way);
  result.jacobian.middleCols<2>(kPlace) = Eigen::Matrix2d::Identity() - rotation;
  result.jacobian.col(kScale) = -way;
  result.jacobian.col(kLate) = motions.then_twist.head<2>() +
                               motions.then_twist.z() * geometry::perpendicular(way) -
                               rotation * motions.now_twist.head<2>();
  return result;
}

TurnDifference turn_difference(const TwoMotions& motions, double overlapping) {
  const double turn = motions.by_odometry.mean.theta();
  TurnDifference result;
  result.value_rad = (motions.by_odometry.mean.inverse() * motions.by_landmarks.mean).theta();
  result.variance_rad2 = motions.by_landmarks.covariance(2, 2) +
                         overlapping * motions.gyro_variance + squared(kTurnModel_rad) +
                         squared(kModelShare * turn);
  result.jacobian.setZero();
  result.jacobian(kLate) = motions.then_twist.z() - motions.now_twist.z();
  // Odometry contains the bias: the rotation by landmarks is smaller by it.
  result.jacobian(kGyroBias) = -motions.seconds;
  return result;
}

}  // namespace understory::keyframer::joint
