#include "eval/harness/camera_relocalisation.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace understory::eval::harness {
namespace {

namespace changes = sim::changes;

/// The two most similar points of the map.
struct BestTwo {
  std::uint32_t best = 0;
  int distance = std::numeric_limits<int>::max();
  int second = std::numeric_limits<int>::max();
};

BestTwo best_two(const changes::Descriptor& descriptor, std::span<const MappedKeypoint> map) {
  BestTwo result;
  for (std::uint32_t i = 0; i < map.size(); ++i) {
    const int distance = changes::hamming_distance(descriptor, map[i].descriptor);
    if (distance >= result.second) continue;
    result.second = std::max(distance, result.distance);
    if (distance >= result.distance) continue;
    result.second = result.distance;
    result.distance = distance;
    result.best = i;
  }
  return result;
}

/// Which keypoint has a point of the map.
struct Claim {
  int distance = std::numeric_limits<int>::max();
  std::uint32_t keypoint = 0;
};

}  // namespace

std::vector<KeypointMatch> match_descriptors(std::span<const changes::Keypoint> keypoints,
                                             std::span<const MappedKeypoint> map,
                                             const RelocalisationParameters& parameters) {
  std::vector<Claim> claims(map.size());
  std::vector<std::uint32_t> wanted(keypoints.size(), std::numeric_limits<std::uint32_t>::max());
  for (std::uint32_t k = 0; k < keypoints.size(); ++k) {
    const BestTwo two = best_two(keypoints[k].descriptor, map);
    const bool is_clear = two.distance <= parameters.ratio * two.second;
    if (two.distance > parameters.max_distance || !is_clear) continue;
    wanted[k] = two.best;
    if (two.distance < claims[two.best].distance) claims[two.best] = {two.distance, k};
  }

  std::vector<KeypointMatch> matches;
  for (std::uint32_t k = 0; k < keypoints.size(); ++k) {
    const bool is_wanted = wanted[k] < map.size();
    if (is_wanted && claims[wanted[k]].keypoint == k) matches.push_back({k, wanted[k]});
  }
  return matches;
}

Relocalisation relocalise(const changes::CameraFrame& frame,
                          const changes::CameraParameters& camera,
                          std::span<const MappedKeypoint> map,
                          const RelocalisationParameters& parameters, std::uint64_t seed) {
  std::vector<geometry::PointSighting> pairs;
  for (const KeypointMatch& match : match_descriptors(frame.keypoints, map, parameters)) {
    pairs.push_back({camera.ray_of(frame.keypoints[match.keypoint].pixel).normalized(),
                     map[match.point].position_m});
  }

  Relocalisation result;
  result.matches = pairs.size();
  result.pose = geometry::find_absolute_pose(pairs, parameters.pose, seed);
  if (!result.pose.is_found) return result;
  const Eigen::Isometry3d map_T_camera = result.pose.camera_T_map.inverse();
  const Eigen::Isometry3d& truth = frame.world_T_camera;
  result.position_error_m = (map_T_camera.translation() - truth.translation()).norm();
  const Eigen::Matrix3d turn = map_T_camera.linear().transpose() * truth.linear();
  result.rotation_error_rad = Eigen::AngleAxisd(turn).angle();
  const double variance_m2 = result.pose.covariance.bottomRightCorner<3, 3>().trace();
  result.is_accepted = variance_m2 <= parameters.max_sigma_m * parameters.max_sigma_m;
  result.is_success = result.is_accepted && result.position_error_m <= parameters.success_m &&
                      result.rotation_error_rad <= parameters.success_rad;
  return result;
}

}  // namespace understory::eval::harness
