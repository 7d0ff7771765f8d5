#include "eval/experiments/existence/camera/keypoint_map.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>

#include "eval/experiments/existence/camera/projection.hpp"

namespace understory::eval::experiments::existence::camera {
namespace {

namespace changes = sim::changes;

/// A point is in the map from so many sightings on: what false keypoints alone make is not.
constexpr std::uint32_t kLeastSightings = 5;
/// Points of one texture that are nearer than this share of their distance are one point.
constexpr double kSamePlace = 0.06;
constexpr int kSameBits = 40;

/// Pixel, disparity; and how they change with the point.
struct Prediction {
  Eigen::Vector3d value;
  Eigen::Matrix3d jacobian;
};

Prediction predict(const changes::CameraParameters& camera, const Eigen::Isometry3d& camera_T_world,
                   const Eigen::Vector3d& position_m) {
  const Eigen::Vector3d at = camera_T_world * position_m;
  const double f = camera.focal_px, z = at.z();
  Eigen::Matrix3d by_point;
  by_point << f / z, 0.0, -f * at.x() / (z * z), 0.0, f / z, -f * at.y() / (z * z), 0.0, 0.0,
      -f * camera.baseline_m / (z * z);
  Prediction prediction;
  prediction.value << camera.project(at), f * camera.baseline_m / z;
  prediction.jacobian = by_point * camera_T_world.linear();
  return prediction;
}

changes::PointId most_frequent(const std::vector<changes::PointId>& ids) {
  std::map<changes::PointId, int> counts;
  changes::PointId best = changes::kNoPoint;
  int most = 0;
  for (const changes::PointId id : ids) {
    if (++counts[id] <= most) continue;
    most = counts[id];
    best = id;
  }
  return best;
}

bool are_one(const CameraPoint& a, const CameraPoint& b) {
  const double near_m = kSamePlace * std::min(a.nearest_m, b.nearest_m);
  return (a.position_m - b.position_m).squaredNorm() < near_m * near_m &&
         changes::hamming_distance(a.descriptor, b.descriptor) <= kSameBits;
}

}  // namespace

void MapBuilder::see(std::size_t point, const changes::CameraFrame& frame,
                     const changes::Keypoint& keypoint) {
  CameraPoint& seen = points_[point];
  Track& track = tracks_[point];
  track.sightings.push_back({frame.world_T_camera.inverse(),
                             {keypoint.pixel.x(), keypoint.pixel.y(), keypoint.disparity_px}});
  track.ids.push_back(keypoint.point);
  ++seen.sightings;
  if (seen.sightings > 1) improve(point);

  const Eigen::Vector3d to_camera_m = frame.world_T_camera.translation() - seen.position_m;
  const double distance_m = to_camera_m.norm();
  seen.seen_from += to_camera_m / distance_m;
  seen.nearest_m = seen.sightings == 1 ? distance_m : std::min(seen.nearest_m, distance_m);
  seen.farthest_m = std::max(seen.farthest_m, distance_m);

  for (std::size_t bit = 0; bit < track.bits_set.size(); ++bit) {
    const std::uint64_t mask = std::uint64_t{1} << (bit % 64);
    track.bits_set[bit] += (keypoint.descriptor[bit / 64] & mask) != 0 ? 1 : 0;
    const bool is_set = 2U * track.bits_set[bit] > seen.sightings;
    seen.descriptor[bit / 64] = (seen.descriptor[bit / 64] & ~mask) | (is_set ? mask : 0);
  }
}

/// One step of least squares over all sightings.
void MapBuilder::improve(std::size_t point) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  for (const Sighting& sighting : tracks_[point].sightings) {
    const Prediction prediction =
        predict(camera_, sighting.camera_T_world, points_[point].position_m);
    const Eigen::Matrix3d& jacobian = prediction.jacobian;
    information += jacobian.transpose() * jacobian;
    gradient += jacobian.transpose() * (sighting.measured - prediction.value);
  }
  points_[point].position_m += information.ldlt().solve(gradient);
}

void MapBuilder::add(const changes::CameraFrame& frame) {
  std::vector<Expected> expected = points_in_view(points_, frame.world_T_camera, camera_);
  associate(expected, points_, frame.keypoints, {});
  std::vector<bool> is_known(frame.keypoints.size(), false);
  for (const Expected& one : expected) {
    if (one.keypoint == kNoKeypoint) continue;
    is_known[one.keypoint] = true;
    see(one.point, frame, frame.keypoints[one.keypoint]);
  }

  for (std::size_t k = 0; k < frame.keypoints.size(); ++k) {
    const changes::Keypoint& keypoint = frame.keypoints[k];
    if (is_known[k] || keypoint.disparity_px <= 1.0) continue;
    CameraPoint point;
    point.position_m =
        frame.world_T_camera * camera_.triangulate(keypoint.pixel, keypoint.disparity_px);
    points_.push_back(point);
    tracks_.emplace_back();
    see(points_.size() - 1, frame, keypoint);
  }
}

std::vector<CameraPoint> MapBuilder::finish() const {
  std::vector<CameraPoint> all;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (points_[i].sightings < kLeastSightings) continue;
    all.push_back(points_[i]);
    all.back().truth = most_frequent(tracks_[i].ids);
  }
  std::stable_sort(all.begin(), all.end(), [](const CameraPoint& a, const CameraPoint& b) {
    return a.sightings > b.sightings;
  });

  std::vector<CameraPoint> map;
  for (const CameraPoint& point : all) {
    const bool is_there = std::any_of(map.begin(), map.end(), [&point](const CameraPoint& other) {
      return are_one(point, other);
    });
    if (!is_there) map.push_back(point);
  }
  return map;
}

}  // namespace understory::eval::experiments::existence::camera
