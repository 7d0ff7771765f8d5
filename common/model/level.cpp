#include "common/model/level.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstdlib>

#include "common/geometry/decompositions.hpp"

namespace understory::model {
namespace {

/// An older estimate is not used: the level's error changes over some seconds.
constexpr Utime kMaxAge_us = 2'000'000;
/// Least share of a detection's covariance that remains without the level's part.
constexpr double kLeastOwnShare = 0.05;

/// Typical distance of landmarks. A level that changes within a revolution displaces landmarks
/// ahead and behind differently, which rotates the pose.
constexpr double kLandmarksAway_m = 15.0;
/// A level with this many times the least variance so far counts as another level.
constexpr double kWorse = 4.0;

}  // namespace

Eigen::Matrix2d level_arm(double height_m) {
  Eigen::Matrix2d arm;
  arm << 0.0, height_m, -height_m, 0.0;
  return arm;
}

Eigen::Matrix2d without_level(const Eigen::Matrix2d& covariance_m2, const Eigen::Matrix2d& arm,
                              const Eigen::Matrix2d& level_covariance_rad2) {
  const Eigen::LLT<Eigen::Matrix2d> factor(covariance_m2);
  const Eigen::Matrix2d root = factor.matrixL().solve(arm);
  const geometry::PrincipalAxes share =
      geometry::principal_axes(root * level_covariance_rad2 * root.transpose());
  const Eigen::Matrix2d axes = factor.matrixL() * share.vectors;
  const Eigen::Vector2d own_share = (1.0 - share.values.array()).cwiseMax(kLeastOwnShare);
  return axes * own_share.asDiagonal() * axes.transpose();
}

LandmarkScan LevelCorrection::levelled(LandmarkScan scan) const {
  if (!level_ || std::abs(scan.utime - level_->utime) > kMaxAge_us) return scan;
  for (Detection& detection : scan.detections) {
    if (!detection.position_m.allFinite() || !detection.covariance_m2.allFinite()) continue;

    // The estimated error displaces the detection in proportion to its height.
    const Eigen::Matrix2d arm = level_arm(detection.position_m.z());
    detection.position_m.head<2>() -= arm * level_->error_rad;

    // Its covariance has the remaining error instead of the whole one.
    const Eigen::Matrix2d whole = detection.covariance_m2.topLeftCorner<2, 2>();
    if (whole.llt().info() != Eigen::Success) continue;
    const Eigen::Matrix2d own = without_level(whole, arm, level_->reported_covariance);
    detection.covariance_m2.topLeftCorner<2, 2>() =
        own + arm * level_->covariance * arm.transpose();
  }
  return scan;
}

Eigen::Matrix2d level_without_imu(const Eigen::Matrix2d& covariance_rad2, double seconds,
                                  double most_rad) {
  const double most = most_rad * most_rad;
  const double largest = 0.5 * covariance_rad2.trace();
  const double added = std::clamp(most - largest, 0.0, kTiltWalk * kTiltWalk * seconds);
  return covariance_rad2 + added * Eigen::Matrix2d::Identity();
}

void SweepLevel::add(const Odometry& odometry) {
  if (odometry.inertial) {
    covariance_rad2_ = odometry.inertial->level.covariance;
    const double trace_rad2 = covariance_rad2_->trace();
    if (least_rad2_ <= 0.0 || trace_rad2 < least_rad2_) least_rad2_ = trace_rad2;
  } else if (covariance_rad2_) {
    const double seconds = 1e-6 * static_cast<double>(odometry.utime - odometry.from_utime);
    covariance_rad2_ = level_without_imu(*covariance_rad2_, seconds, kMostTiltOfPoses_rad);
  }
}

Eigen::Matrix3d SweepLevel::pose_covariance() const {
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  if (!covariance_rad2_ || covariance_rad2_->trace() < kWorse * kWorse * least_rad2_)
    return covariance;
  const Eigen::Matrix2d arm = level_arm(kLandmarkHeight_m);
  covariance.topLeftCorner<2, 2>() = arm * *covariance_rad2_ * arm.transpose();
  const double turn = kLandmarkHeight_m / kLandmarksAway_m;
  covariance(2, 2) = 0.5 * turn * turn * covariance_rad2_->trace();
  return covariance;
}

}  // namespace understory::model
