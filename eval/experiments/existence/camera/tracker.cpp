#include "eval/experiments/existence/camera/tracker.hpp"

#include <array>
#include <limits>
#include <map>
#include <vector>

#include "eval/experiments/existence/camera/projection.hpp"

namespace understory::eval::experiments::existence::camera {
namespace {

/// A prediction is less certain than a corrected pose, and what is wrongly paired is found out.
constexpr double kTrackingSigmas = 3.5;
/// A bearing to a mapped point, both together.
constexpr geometry::AbsolutePoseParameters kUpdate{
    .sigma_rad = 0.002, .max_iterations = 50, .min_inliers = 4};
constexpr std::uint64_t kSampling = 1;
/// What was moved was moved as one: all points within a cube of this side have one vote.
constexpr double kOneVote_m = 2.0;
/// The first pose, and what odometry adds per frame beside its noise: no error is zero.
constexpr double kStartVariance = 1e-6;
constexpr double kLeastVariance = 1e-6;

std::vector<double> one_vote_per_place(const std::vector<geometry::PointSighting>& pairs) {
  const auto place = [](const Eigen::Vector3d& point_m) {
    const Eigen::Vector3i cell = (point_m / kOneVote_m).array().floor().cast<int>();
    return std::array{cell.x(), cell.y(), cell.z()};
  };
  std::map<std::array<int, 3>, int> counts;
  for (const geometry::PointSighting& pair : pairs) ++counts[place(pair.point_m)];
  std::vector<double> weights;
  weights.reserve(pairs.size());
  for (const geometry::PointSighting& pair : pairs)
    weights.push_back(1.0 / counts[place(pair.point_m)]);
  return weights;
}

/// A covariance of (rotation, translation) in the frame that `to_T_from` leads to.
Eigen::Matrix<double, 6, 6> moved(const Eigen::Matrix<double, 6, 6>& covariance,
                                  const Eigen::Isometry3d& to_T_from) {
  const Eigen::Vector3d& t = to_T_from.translation();
  Eigen::Matrix3d cross;
  cross << 0.0, -t.z(), t.y(), t.z(), 0.0, -t.x(), -t.y(), t.x(), 0.0;
  Eigen::Matrix<double, 6, 6> adjoint = Eigen::Matrix<double, 6, 6>::Zero();
  adjoint.topLeftCorner<3, 3>() = to_T_from.linear();
  adjoint.bottomRightCorner<3, 3>() = to_T_from.linear();
  adjoint.bottomLeftCorner<3, 3>() = cross * to_T_from.linear();
  return adjoint * covariance * adjoint.transpose();
}

}  // namespace

void CameraTracker::predict(const Eigen::Isometry3d& truth) {
  if (!is_started_) {
    pose_.camera_T_map = truth.inverse();
    pose_.covariance = kStartVariance * Eigen::Matrix<double, 6, 6>::Identity();
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

    const Eigen::Isometry3d now_T_before = step.inverse();
    pose_.camera_T_map = now_T_before * pose_.camera_T_map;
    pose_.covariance = moved(pose_.covariance, now_T_before);
    pose_.covariance.diagonal().head<3>().array() += odometry_.turn_rad * odometry_.turn_rad;
    pose_.covariance.diagonal().tail<3>().array() += sigma_m * sigma_m + kLeastVariance;
  }
  last_truth_ = truth;
  is_started_ = true;
}

Eigen::Isometry3d CameraTracker::track(const sim::changes::CameraFrame& frame,
                                       std::span<const CameraPoint> map) {
  predict(frame.world_T_camera);
  std::vector<Expected> expected = points_in_view(map, pose_.camera_T_map.inverse(), camera_);
  const PoseGate gate{.covariance = pose_.covariance,
                      .sigmas = kTrackingSigmas,
                      .max_pixel = std::numeric_limits<double>::infinity()};
  associate_within(expected, map, frame.keypoints, camera_, gate);
  std::vector<geometry::PointSighting> pairs;
  for (const Expected& one : expected) {
    if (one.keypoint == kNoKeypoint) continue;
    const Eigen::Vector3d ray = camera_.ray_of(frame.keypoints[one.keypoint].pixel);
    pairs.push_back({ray.normalized(), map[one.point].position_m});
  }

  const geometry::AbsolutePose updated =
      geometry::update_absolute_pose(pairs, one_vote_per_place(pairs), pose_, kUpdate, kSampling);
  pose_ = {updated.camera_T_map, updated.covariance};
  lost_ += updated.is_found ? 0 : 1;
  return pose_.camera_T_map.inverse();
}

}  // namespace understory::eval::experiments::existence::camera
