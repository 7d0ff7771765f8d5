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

}  // namespace

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
  Eigen::Matrix2d by_height;
  by_height << 0.0, 1.0, -1.0, 0.0;

  for (Detection& detection : scan.detections) {
    if (!detection.position_m.allFinite() || !detection.covariance_m2.allFinite()) continue;

    // The estimated error displaces the detection by its height.
    const Eigen::Matrix2d arm = detection.position_m.z() * by_height;
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

Eigen::Matrix2d level_without_imu(const Eigen::Matrix2d& covariance_rad2, double seconds) {
  const double most = kMostTilt_rad * kMostTilt_rad;
  const double largest = 0.5 * covariance_rad2.trace();
  const double added = std::clamp(most - largest, 0.0, kTiltWalk * kTiltWalk * seconds);
  return covariance_rad2 + added * Eigen::Matrix2d::Identity();
}

}  // namespace understory::model
