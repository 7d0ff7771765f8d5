// Keyframes of one scan a second, for drives past trees.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "common/model/keyframe.hpp"

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

}  // namespace understory::test
