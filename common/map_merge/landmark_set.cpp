#include "common/map_merge/landmark_set.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace understory::map_merge {
namespace {

constexpr double kCell_m = 5.0;
/// The distance to this neighbour determines the density of landmarks.
constexpr std::size_t kDensityNeighbour = 4;
/// Largest number of landmarks sampled for it.
constexpr std::size_t kSamples = 2000;

bool is_usable(const model::MapLandmark& landmark) {
  return constellation::PointGrid::representable(landmark.position_m) &&
         landmark.covariance_m2.allFinite() && landmark.covariance_m2.trace() >= 0.0;
}

}  // namespace

LandmarkSet::LandmarkSet(std::span<const model::MapLandmark> landmarks, double unknown_sigma_m)
    : grid_(kCell_m) {
  const Eigen::Matrix2d unknown = unknown_sigma_m * unknown_sigma_m * Eigen::Matrix2d::Identity();
  landmarks_.reserve(landmarks.size());
  for (std::uint32_t i = 0; i < landmarks.size(); ++i) {
    const model::MapLandmark& one = landmarks[i];
    if (!is_usable(one)) continue;
    grid_.insert(static_cast<constellation::Slot>(landmarks_.size()), one.position_m);
    const bool is_known = one.covariance_m2.trace() > 0.0;
    landmarks_.push_back({one.position_m, is_known ? one.covariance_m2 : unknown, one.kind, i});
  }
  spacing_m_ = usual_spacing();
}

std::size_t LandmarkSet::count_within(const Eigen::Vector2d& point_m, double radius_m) const {
  std::size_t count = 0;
  if (!constellation::PointGrid::representable(point_m)) return count;
  grid_.for_each_within(point_m.x(), point_m.y(), radius_m,
                        [&](constellation::Slot /*slot*/, double /*squared*/) { ++count; });
  return count;
}

std::vector<std::uint32_t> LandmarkSet::nearest(const Eigen::Vector2d& point_m,
                                                std::size_t count) const {
  std::vector<std::pair<double, std::uint32_t>> by_distance;
  by_distance.reserve(landmarks_.size());
  for (std::uint32_t i = 0; i < landmarks_.size(); ++i)
    by_distance.emplace_back((landmarks_[i].position_m - point_m).squaredNorm(), i);
  const std::size_t taken = std::min(count, by_distance.size());
  std::partial_sort(by_distance.begin(), by_distance.begin() + static_cast<std::ptrdiff_t>(taken),
                    by_distance.end());

  std::vector<std::uint32_t> result;
  result.reserve(taken);
  for (std::size_t i = 0; i < taken; ++i) result.push_back(by_distance[i].second);
  return result;
}

double LandmarkSet::usual_spacing() const {
  if (landmarks_.size() <= kDensityNeighbour) return kCell_m;
  const std::size_t step = 1 + landmarks_.size() / kSamples;
  std::vector<double> distances;
  distances.reserve(landmarks_.size() / step + 1);
  for (std::size_t i = 0; i < landmarks_.size(); i += step) {
    const Eigen::Vector2d& at = landmarks_[i].position_m;
    std::vector<double> around;
    grid_.for_each_outward(
        at.x(), at.y(),
        [&](constellation::Slot /*slot*/, double squared) { around.push_back(squared); },
        [&](double radius_m) {
          const auto inside = std::ranges::count_if(
              around, [&](double squared) { return squared <= radius_m * radius_m; });
          return static_cast<std::size_t>(inside) > kDensityNeighbour || radius_m > 1e3;
        });
    std::ranges::sort(around);
    // The landmark itself is the first.
    distances.push_back(std::sqrt(around[std::min(kDensityNeighbour, around.size() - 1)]));
  }

  std::ranges::nth_element(distances,
                           distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2));
  const double median = distances[distances.size() / 2];
  return std::max(0.1, median * std::sqrt(std::numbers::pi / kDensityNeighbour));
}

}  // namespace understory::map_merge
