// Follows the camera in a map: odometry predicts with a covariance, the map's points correct.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <random>
#include <span>

#include "common/geometry/absolute_pose.hpp"
#include "eval/experiments/existence/camera/keypoint_map.hpp"

namespace understory::eval::experiments::existence::camera {

/// Errors of the odometry from one frame to the next.
struct OdometrySetting {
  double share_of_way = 0.03;  ///< Standard deviation per axis, of the way [m/m].
  double turn_rad = 0.005;     ///< Per axis.
};

/// Starts at the first frame's true pose, as after a relocalisation. Pose and odometry are weighed
/// by their covariances, and points of one place count as one: a thing that was moved and has many
/// points does not pull the pose after it.
class CameraTracker {
 public:
  CameraTracker(const sim::changes::CameraParameters& camera, std::uint64_t seed)
      : camera_(camera), random_(seed) {}

  /// The frame's pose in the map. Of the truth it reads the first pose and the odometry alone.
  Eigen::Isometry3d track(const sim::changes::CameraFrame& frame, std::span<const CameraPoint> map);
  /// Of camera_T_world of the last frame, as in geometry::AbsolutePose.
  const Eigen::Matrix<double, 6, 6>& covariance() const { return pose_.covariance; }
  /// Frames in which fewer than four points agreed, so that odometry counted most.
  int lost() const { return lost_; }

 private:
  void predict(const Eigen::Isometry3d& truth);

  sim::changes::CameraParameters camera_;
  OdometrySetting odometry_;
  std::mt19937_64 random_;
  geometry::PosePrior pose_;  ///< camera_T_world.
  Eigen::Isometry3d last_truth_ = Eigen::Isometry3d::Identity();
  bool is_started_ = false;
  int lost_ = 0;
};

}  // namespace understory::eval::experiments::existence::camera
