#include "eval/experiments/existence/camera/tracker.hpp"

#include <vector>

#include "common/geometry/absolute_pose.hpp"
#include "eval/experiments/existence/camera/projection.hpp"

namespace understory::eval::experiments::existence::camera {
namespace {

/// Before the pose is corrected points may be this far from where they are expected.
constexpr Gate kWideGate{25.0, 4.0, 70};
constexpr std::uint64_t kSampling = 1;

}  // namespace

void CameraTracker::predict(const Eigen::Isometry3d& truth) {
  if (!is_started_) {
    world_T_camera_ = truth;
  } else {
    Eigen::Isometry3d step = last_truth_.inverse() * truth;
    const double sigma_m = odometry_.share_of_way * step.translation().norm();
    std::normal_distribution<double> normal;
    Eigen::Vector3d turn, shift;
    for (int axis = 0; axis < 3; ++axis) {
      shift[axis] = sigma_m * normal(random_);
      turn[axis] = odometry_.turn_rad * normal(random_);
    }
    step.pretranslate(shift);
    step.rotate(Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()));
    world_T_camera_ = world_T_camera_ * step;
  }
  last_truth_ = truth;
  is_started_ = true;
}

const Eigen::Isometry3d& CameraTracker::track(const sim::changes::CameraFrame& frame,
                                              std::span<const CameraPoint> map) {
  predict(frame.world_T_camera);
  std::vector<Expected> expected = points_in_view(map, world_T_camera_, camera_);
  associate(expected, map, frame.keypoints, kWideGate);
  std::vector<geometry::PointSighting> pairs;
  for (const Expected& one : expected) {
    if (one.keypoint == kNoKeypoint) continue;
    const Eigen::Vector3d ray = camera_.ray_of(frame.keypoints[one.keypoint].pixel);
    pairs.push_back({ray.normalized(), map[one.point].position_m});
  }

  const geometry::AbsolutePose pose = geometry::find_absolute_pose(pairs, {}, kSampling);
  if (pose.is_found)
    world_T_camera_ = pose.camera_T_map.inverse();
  else
    ++lost_;
  return world_T_camera_;
}

}  // namespace understory::eval::experiments::existence::camera
