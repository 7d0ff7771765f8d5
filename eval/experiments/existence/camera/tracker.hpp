// Follows the camera in a map: odometry predicts, the map's points correct.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <random>
#include <span>

#include "eval/experiments/existence/camera/keypoint_map.hpp"

namespace understory::eval::experiments::existence::camera {

/// Errors of the odometry from one frame to the next.
struct OdometrySetting {
  double share_of_way = 0.03;  ///< Standard deviation per axis, of the way [m/m].
  double turn_rad = 0.005;     ///< Per axis.
};

/// Starts at the first frame's true pose, as after a relocalisation.
class CameraTracker {
 public:
  CameraTracker(const sim::changes::CameraParameters& camera, std::uint64_t seed)
      : camera_(camera), random_(seed) {}

  /// The frame's pose in the map. Of the truth it reads the first pose and the odometry alone.
  const Eigen::Isometry3d& track(const sim::changes::CameraFrame& frame,
                                 std::span<const CameraPoint> map);
  /// Frames in which too few points agreed, so that odometry alone counted.
  int lost() const { return lost_; }

 private:
  void predict(const Eigen::Isometry3d& truth);

  sim::changes::CameraParameters camera_;
  OdometrySetting odometry_;
  std::mt19937_64 random_;
  Eigen::Isometry3d world_T_camera_ = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d last_truth_ = Eigen::Isometry3d::Identity();
  bool is_started_ = false;
  int lost_ = 0;
};

}  // namespace understory::eval::experiments::existence::camera
