// Pairs of landmarks of two frames: the motion on which most agree, and its covariance.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/place_recognition/level_stems.hpp"

namespace understory::place_recognition {

/// Indices of a landmark of the query and of a candidate in the frame.
struct LandmarkPair {
  std::uint32_t query = 0;
  std::uint32_t frame = 0;
};

/// A relative pose and its pairs.
struct PairedPose {
  geometry::SE2 frame_T_query;
  std::vector<LandmarkPair> pairs;
};

/// Landmarks of two frames.
struct LandmarkSets {
  std::span<const LevelStem> query;
  std::span<const LevelStem> frame;
};

/// The least-squares motion over all pairs; identity without pairs.
geometry::SE2 aligned_pose(const LandmarkSets& landmarks, std::span<const LandmarkPair> pairs);

/// The motion through two of the pairs on which most pairs agree within `gate_m` [m], aligned by
/// them. None where fewer than two pairs agree. O(pairs^3).
std::optional<PairedPose> most_agreed(const LandmarkSets& landmarks,
                                      std::span<const LandmarkPair> pairs, double gate_m);

/// Each other's nearest neighbours within `gate_m` [m] at a pose, by index of the query. O(n m).
std::vector<LandmarkPair> mutual_pairs(const LandmarkSets& landmarks,
                                       const geometry::SE2& frame_T_query, double gate_m);

/// Alternates pairing and alignment from a start until the pairs stay the same; at most ten times.
PairedPose refined_pose(const LandmarkSets& landmarks, const geometry::SE2& start, double gate_m);

/// Covariance of an aligned pose: the inverse of the information of its pairs, with standard
/// deviation `sigma_m` per axis or that of the residuals, whichever is larger. Tangent order, right
/// perturbation. With fewer than two pairs the prior alone: 100 m, 10 rad.
Eigen::Matrix3d paired_covariance(const LandmarkSets& landmarks, const PairedPose& pose,
                                  double sigma_m);

/// The nearest `most` landmarks to the sensor, in the order given.
std::vector<LevelStem> nearest_landmarks(std::span<const LevelStem> landmarks, std::size_t most);

}  // namespace understory::place_recognition
