// Which points of a map should be in an image, and which keypoints they are.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/existence/look.hpp"
#include "eval/experiments/existence/camera/keypoint_map.hpp"

namespace understory::eval::experiments::existence::camera {

inline constexpr std::uint32_t kNoKeypoint = std::numeric_limits<std::uint32_t>::max();

/// A point that is expected in the image.
struct Expected {
  std::uint32_t point = 0;
  Eigen::Vector3d camera_point_m = Eigen::Vector3d::Zero();
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double disparity_px = 0.0;
  std::uint32_t keypoint = kNoKeypoint;  ///< The one that it is taken for.
};

/// How far a keypoint may be from where its point is expected.
struct Gate {
  double pixel = 6.0;
  double disparity_px = 3.0;
  int descriptor_bits = 70;
};

/// Which keypoints may be a point where the pose is known with a covariance.
struct PoseGate {
  /// Of camera_T_world, order and frame as in geometry::AbsolutePose.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  double sigmas = 2.5;  ///< Of pixel and disparity together (Mahalanobis).
  /// A point whose pixel the pose leaves open by more than this (at `sigmas`) is not looked for.
  double max_pixel = 25.0;
  int descriptor_bits = 70;
};

/// Points in the frustum that were mapped from about there: within 60 degrees of the mean direction
/// of their sightings, and of their distances within a quarter (as ORB-SLAM asks).
std::vector<Expected> points_in_view(std::span<const CameraPoint> map,
                                     const Eigen::Isometry3d& world_T_camera,
                                     const sim::changes::CameraParameters& camera);

/// Gives each expected point the keypoint in the gate with the most similar descriptor; a keypoint
/// that several points want goes to the most similar one. Cost O(expected * keypoints).
void associate(std::span<Expected> expected, std::span<const CameraPoint> map,
               std::span<const sim::changes::Keypoint> keypoints, const Gate& gate);

/// The same within the pose's covariance and the detector's noise. Points that the pose leaves too
/// open are taken out of `expected`: whether they are seen says nothing.
void associate_within(std::vector<Expected>& expected, std::span<const CameraPoint> map,
                      std::span<const sim::changes::Keypoint> keypoints,
                      const sim::changes::CameraParameters& camera, const PoseGate& gate);

/// What the disparity of the keypoint nearest to the line of sight says about it: in front within
/// 30 px, behind within 10 px; kUnknown where none is.
understory::existence::Ray ray_beside(const Expected& expected,
                                      std::span<const sim::changes::Keypoint> keypoints,
                                      const sim::changes::CameraParameters& camera);

}  // namespace understory::eval::experiments::existence::camera
