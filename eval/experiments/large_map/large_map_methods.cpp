#include "eval/experiments/large_map/large_map_methods.hpp"

#include <cmath>
#include <random>
#include <stdexcept>

#include "common/constellation/map.hpp"
#include "common/hierarchy/baseline/hierarchy.hpp"
#include "common/hierarchy/baseline/matching.hpp"
#include "services/geoslam_mapper/baseline/pose.hpp"
#include "services/geoslam_mapper/parameters.hpp"

namespace understory::eval::experiments::large_map {
namespace {

class ConstellationFinder final : public PlaceFinder {
 public:
  explicit ConstellationFinder(std::span<const Eigen::Vector2d> landmarks_m) {
    for (std::size_t i = 0; i < landmarks_m.size(); ++i) map_.insert(i + 1, landmarks_m[i]);
  }

  PlaceAnswer find(const model::Keyframe& keyframe) const override {
    std::vector<constellation::ObservedPoint> points;
    points.reserve(keyframe.landmarks.size());
    for (const model::KeyframeLandmark& landmark : keyframe.landmarks) {
      points.push_back({landmark.position_m, std::sqrt(0.5 * landmark.covariance_m2.trace())});
    }
    const constellation::Localisation found = map_.localise(points);
    if (!found.found()) return {std::nullopt, std::string(describe(found.outcome))};
    return {found.map_T_sensor * keyframe.centre_T_base(), {}};
  }
  double bytes_per_landmark() const override {
    return static_cast<double>(map_.bytes()) / static_cast<double>(map_.size());
  }

 private:
  constellation::ConstellationMap map_;
};

class BaselineFinder final : public PlaceFinder {
 public:
  explicit BaselineFinder(std::span<const Eigen::Vector2d> landmarks_m)
      : landmarks_m_(landmarks_m.begin(), landmarks_m.end()),
        hierarchy_(landmarks_m_, parameters_.descriptor_step) {}

  PlaceAnswer find(const model::Keyframe& keyframe) const override {
    std::vector<Eigen::Vector2d> local;
    for (const model::KeyframeLandmark& landmark : keyframe.landmarks) {
      local.push_back(landmark.position_m);
    }
    const std::vector<hierarchy::baseline::PointMatch> pairs = match(local);
    if (pairs.size() < static_cast<std::size_t>(parameters_.min_associations)) {
      return {std::nullopt, "too few associations of polygons"};
    }
    std::mt19937 random(10);  // the published code's seed, for every keyframe
    const auto estimate =
        geoslam_mapper::baseline::estimate_pose(local, landmarks_m_, pairs, parameters_, random);
    if (!estimate) return {std::nullopt, "no pose with enough associations"};
    const Eigen::Vector3d pose = estimate->map_T_base.pose().coordinates();
    return {geometry::SE2(pose.x(), pose.y(), pose.z()) * keyframe.centre_T_base(), {}};
  }

 private:
  /// Algorithm 3, lines 5-7.
  std::vector<hierarchy::baseline::PointMatch> match(std::span<const Eigen::Vector2d> local) const {
    const hierarchy::baseline::Hierarchy hierarchy(local, parameters_.descriptor_step);
    const hierarchy::baseline::HierarchyMatches matches(
        hierarchy, hierarchy_,
        {parameters_.max_descriptor_distance, parameters_.max_side_difference,
         parameters_.min_triangle_match_ratio});
    double tau = parameters_.initial_descriptor_distance;
    while (true) {
      std::vector<hierarchy::baseline::PointMatch> pairs = matches.points(tau);
      tau += parameters_.descriptor_distance_step;
      if (pairs.size() >= static_cast<std::size_t>(parameters_.min_associations) ||
          tau > parameters_.max_descriptor_distance) {
        return pairs;
      }
    }
  }

  geoslam_mapper::BaselineMapperParameters parameters_;
  std::vector<Eigen::Vector2d> landmarks_m_;
  hierarchy::baseline::Hierarchy hierarchy_;
};

}  // namespace

std::unique_ptr<PlaceFinder> make_place_finder(std::string_view method,
                                               std::span<const Eigen::Vector2d> landmarks_m) {
  if (method == "smoothing") return std::make_unique<ConstellationFinder>(landmarks_m);
  if (method == "baseline") return std::make_unique<BaselineFinder>(landmarks_m);
  throw std::invalid_argument("no such method: " + std::string(method));
}

}  // namespace understory::eval::experiments::large_map
