// Where is the camera: its keypoints found again in a map of keypoints, without any prior.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/absolute_pose.hpp"
#include "sim/changes/keypoint_camera.hpp"

namespace understory::eval::harness {

/// A point of the map. It has no id: pairs are found by descriptors alone.
struct MappedKeypoint {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< Frame `map`.
  sim::changes::Descriptor descriptor{};
};

/// When two descriptors are a pair, when a pose is right.
struct RelocalisationParameters {
  int max_distance = 70;  ///< Bits of 256.
  double ratio = 0.85;    ///< The best distance is at most this share of the second best one.
  geometry::AbsolutePoseParameters pose{.threshold_rad = 0.006, .sigma_rad = 0.0015};
  double max_sigma_m = 0.15;  ///< Of the place, all axes together: less certain is not found.
  double success_m = 0.25;
  double success_rad = 0.035;
};

/// A keypoint and the point of the map that it is taken for.
struct KeypointMatch {
  std::uint32_t keypoint = 0;
  std::uint32_t point = 0;
};
/// For each keypoint the point with the most similar descriptor, where it is similar enough and
/// clearly the best (Lowe 2004), and no other keypoint is more similar to it. In order of keypoint.
/// Cost O(keypoints * points).
std::vector<KeypointMatch> match_descriptors(std::span<const sim::changes::Keypoint> keypoints,
                                             std::span<const MappedKeypoint> map,
                                             const RelocalisationParameters& parameters);

/// What became of one frame.
struct Relocalisation {
  geometry::AbsolutePose pose;
  std::size_t matches = 0;
  double position_error_m = 0.0;  ///< Of the camera's place; 0 where no pose was found.
  double rotation_error_rad = 0.0;
  bool is_accepted = false;  ///< Found, and certain enough by its own covariance.
  bool is_success = false;   ///< Accepted, and within the limits.
};

/// Descriptors, then P3P in RANSAC with the pixels of the left image. The frame's true pose (its
/// `world` is the map's frame) is used for the errors alone.
Relocalisation relocalise(const sim::changes::CameraFrame& frame,
                          const sim::changes::CameraParameters& camera,
                          std::span<const MappedKeypoint> map,
                          const RelocalisationParameters& parameters, std::uint64_t seed);

}  // namespace understory::eval::harness
