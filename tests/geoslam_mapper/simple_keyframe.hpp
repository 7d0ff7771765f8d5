// Keyframes of one scan a second, for drives past trees.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "common/model/keyframe.hpp"
#include "common/model/odometry.hpp"

namespace understory::test {

inline model::Utime utime_of(int i) { return 1'000'000 * (static_cast<model::Utime>(i) + 1); }

/// Nothing seen yet.
inline model::Keyframe simple_keyframe(int i, double range_m) {
  model::Keyframe keyframe;
  keyframe.utime = utime_of(i);
  keyframe.sequence = static_cast<std::uint64_t>(i);
  keyframe.field_of_view.max_range_m = range_m;
  keyframe.members.push_back({keyframe.utime, keyframe.sequence, {}, Eigen::Matrix3d::Zero()});
  return keyframe;
}

inline model::KeyframeLandmark simple_tree(const Eigen::Vector2d& seen_m, double sigma_m,
                                           std::uint16_t scans = 4) {
  model::KeyframeLandmark landmark;
  landmark.position_m = seen_m;
  landmark.covariance_m2 = sigma_m * sigma_m * Eigen::Matrix2d::Identity();
  landmark.radius_m = 0.2;
  landmark.observation_count = scans;
  return landmark;
}

/// Straight on from the last keyframe; `error`: in sigmas.
inline model::Odometry simple_odometry(int i, double step_m, const Eigen::Vector3d& sigma,
                                       const Eigen::Vector3d& error) {
  model::Odometry motion;
  motion.sequence = static_cast<std::uint64_t>(i);
  motion.from_utime = utime_of(i - 1);
  motion.utime = utime_of(i);
  motion.from_T_to =
      geometry::SE2(step_m, 0.0, 0.0) * geometry::SE2::Exp(sigma.cwiseProduct(error));
  motion.covariance = sigma.cwiseAbs2().asDiagonal();
  motion.has_wheels = true;
  return motion;
}

}  // namespace understory::test
