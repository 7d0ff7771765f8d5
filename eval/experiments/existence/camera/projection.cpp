#include "eval/experiments/existence/camera/projection.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace understory::eval::experiments::existence::camera {
namespace {

namespace changes = sim::changes;

constexpr double kCosineOfView = 0.5;
constexpr double kNearer = 0.8;
constexpr double kFarther = 1.25;
/// A keypoint so near to the line of sight tells what is on it [px]: of what is in front, which is
/// a surface, less nearness is asked than of what is behind.
constexpr double kBesideInFront = 30.0;
constexpr double kBesideBehind = 10.0;
/// Disparities differ by chance up to so many standard deviations.
constexpr double kDisparitySigmas = 4.0;

bool is_seen_from(const CameraPoint& point, const Eigen::Vector3d& to_camera_m) {
  const double distance_m = to_camera_m.norm();
  if (distance_m < kNearer * point.nearest_m || distance_m > kFarther * point.farthest_m)
    return false;
  return point.seen_from.dot(to_camera_m) > kCosineOfView * point.seen_from.norm() * distance_m;
}

/// Which point has a keypoint.
struct Owner {
  int bits = std::numeric_limits<int>::max();
  std::uint32_t expected = 0;
};

bool is_in_gate(const Expected& expected, const changes::Keypoint& keypoint, const Gate& gate) {
  return std::abs(keypoint.disparity_px - expected.disparity_px) <= gate.disparity_px &&
         (keypoint.pixel - expected.pixel).squaredNorm() <= gate.pixel * gate.pixel;
}

/// Variances of the detector and of the mapped point together [px^2]: pixel per axis, disparity.
constexpr double kPixelVariance = 0.5;
constexpr double kDisparityVariance = 0.45;

/// Of pixel and disparity of a point, by the pose alone [px^2].
Eigen::Matrix3d covariance_by_pose(const Eigen::Vector3d& at,
                                   const changes::CameraParameters& camera,
                                   const Eigen::Matrix<double, 6, 6>& pose) {
  const double f = camera.focal_px, z = at.z();
  Eigen::Matrix3d by_point;
  by_point << f / z, 0.0, -f * at.x() / (z * z), 0.0, f / z, -f * at.y() / (z * z), 0.0, 0.0,
      -f * camera.baseline_m / (z * z);
  Eigen::Matrix<double, 3, 6> motion;
  motion << 0.0, at.z(), -at.y(), 1.0, 0.0, 0.0, -at.z(), 0.0, at.x(), 0.0, 1.0, 0.0, at.y(),
      -at.x(), 0.0, 0.0, 0.0, 1.0;
  const Eigen::Matrix<double, 3, 6> by_pose = by_point * motion;
  return by_pose * pose * by_pose.transpose();
}

/// Gives the keypoints away; `is_near(e, keypoint)` says which may be the expected point e.
template <typename IsNear>
void give_keypoints(std::span<Expected> expected, std::span<const CameraPoint> map,
                    std::span<const changes::Keypoint> keypoints, int most_bits,
                    const IsNear& is_near) {
  std::vector<Owner> owners(keypoints.size());
  std::vector<std::uint32_t> wanted(expected.size(), kNoKeypoint);
  for (std::uint32_t e = 0; e < expected.size(); ++e) {
    int least = most_bits + 1;
    for (std::uint32_t k = 0; k < keypoints.size(); ++k) {
      if (!is_near(e, keypoints[k])) continue;
      const int bits =
          changes::hamming_distance(keypoints[k].descriptor, map[expected[e].point].descriptor);
      if (bits >= least) continue;
      least = bits;
      wanted[e] = k;
    }
    if (wanted[e] == kNoKeypoint || least >= owners[wanted[e]].bits) continue;
    owners[wanted[e]] = {least, e};
  }

  for (std::uint32_t e = 0; e < expected.size(); ++e) {
    const bool is_owner = wanted[e] != kNoKeypoint && owners[wanted[e]].expected == e;
    expected[e].keypoint = is_owner ? wanted[e] : kNoKeypoint;
  }
}

}  // namespace

std::vector<Expected> points_in_view(std::span<const CameraPoint> map,
                                     const Eigen::Isometry3d& world_T_camera,
                                     const changes::CameraParameters& camera) {
  const Eigen::Isometry3d camera_T_world = world_T_camera.inverse();
  std::vector<Expected> expected;
  for (std::uint32_t i = 0; i < map.size(); ++i) {
    const Eigen::Vector3d at = camera_T_world * map[i].position_m;
    if (!camera.sees(at)) continue;
    if (!is_seen_from(map[i], world_T_camera.translation() - map[i].position_m)) continue;
    expected.push_back(
        {i, at, camera.project(at), camera.focal_px * camera.baseline_m / at.z(), kNoKeypoint});
  }
  return expected;
}

void associate(std::span<Expected> expected, std::span<const CameraPoint> map,
               std::span<const changes::Keypoint> keypoints, const Gate& gate) {
  give_keypoints(expected, map, keypoints, gate.descriptor_bits,
                 [&](std::uint32_t e, const changes::Keypoint& keypoint) {
                   return is_in_gate(expected[e], keypoint, gate);
                 });
}

void associate_within(std::vector<Expected>& expected, std::span<const CameraPoint> map,
                      std::span<const changes::Keypoint> keypoints,
                      const changes::CameraParameters& camera, const PoseGate& gate) {
  const double most_variance = gate.max_pixel * gate.max_pixel / (gate.sigmas * gate.sigmas);
  std::vector<Eigen::Matrix3d> information;
  std::erase_if(expected, [&](const Expected& one) {
    Eigen::Matrix3d covariance = covariance_by_pose(one.camera_point_m, camera, gate.covariance);
    if (covariance.topLeftCorner<2, 2>().trace() > most_variance) return true;
    covariance.diagonal() += Eigen::Vector3d(kPixelVariance, kPixelVariance, kDisparityVariance);
    information.emplace_back(covariance.inverse());
    return false;
  });

  give_keypoints(expected, map, keypoints, gate.descriptor_bits,
                 [&](std::uint32_t e, const changes::Keypoint& keypoint) {
                   Eigen::Vector3d off;
                   off << keypoint.pixel - expected[e].pixel,
                       keypoint.disparity_px - expected[e].disparity_px;
                   return off.dot(information[e] * off) <= gate.sigmas * gate.sigmas;
                 });
}

understory::existence::Ray ray_beside(const Expected& expected,
                                      std::span<const changes::Keypoint> keypoints,
                                      const changes::CameraParameters& camera) {
  const changes::Keypoint* nearest = nullptr;
  double least = kBesideInFront * kBesideInFront;
  for (const changes::Keypoint& keypoint : keypoints) {
    const double distance = (keypoint.pixel - expected.pixel).squaredNorm();
    if (distance >= least || keypoint.disparity_px <= 0.0) continue;
    least = distance;
    nearest = &keypoint;
  }
  if (nearest == nullptr) return understory::existence::Ray::kUnknown;

  // Errors are those of the disparity: compared there, not in metres.
  const double nearer_px = nearest->disparity_px - expected.disparity_px;
  const double tolerance_px = kDisparitySigmas * camera.disparity_sigma;
  if (nearer_px > tolerance_px) return understory::existence::Ray::kBlocked;
  const bool is_close = least <= kBesideBehind * kBesideBehind;
  if (is_close && nearer_px < -tolerance_px) return understory::existence::Ray::kPassed;
  return understory::existence::Ray::kUnknown;
}

}  // namespace understory::eval::experiments::existence::camera
