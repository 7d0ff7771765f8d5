#include "services/viewer/submap_places.hpp"

#include <algorithm>

namespace understory::viewer {
namespace {

double cross(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return (a.x() - o.x()) * (b.y() - o.y()) - (a.y() - o.y()) * (b.x() - o.x());
}

void append_in_map(const SubmapPlace& place, std::vector<model::MapLandmark>& landmarks) {
  const Eigen::Matrix2d rotation = place.map_T_submap.rotation();
  for (model::MapLandmark landmark : place.landmarks) {
    landmark.position_m = place.map_T_submap * landmark.position_m;
    landmark.covariance_m2 = rotation * landmark.covariance_m2 * rotation.transpose();
    landmarks.push_back(landmark);
  }
}

bool has_moved(const geometry::SE2& a, const geometry::SE2& b) {
  return a.coordinates() != b.coordinates();
}

}  // namespace

std::vector<Eigen::Vector2d> convex_hull(std::vector<Eigen::Vector2d> points_m) {
  std::ranges::sort(points_m, [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  if (points_m.size() < 3) return points_m;

  // Andrew's monotone chain: the lower side, then the upper one.
  std::vector<Eigen::Vector2d> hull;
  const auto add = [&hull](const Eigen::Vector2d& point, std::size_t kept) {
    while (hull.size() >= kept + 2 && cross(hull[hull.size() - 2], hull.back(), point) <= 0.0)
      hull.pop_back();
    hull.push_back(point);
  };
  for (const Eigen::Vector2d& point : points_m) add(point, 0);
  const std::size_t lower = hull.size() - 1;
  for (std::size_t i = points_m.size() - 1; i-- > 0;) add(points_m[i], lower);
  hull.pop_back();
  return hull;
}

std::vector<model::MapLandmark> SubmapPlaces::take(const model::Submap& submap) {
  if (places_.contains(submap.id)) return {};
  for (const model::SubmapId id : submap.replaced) {
    const auto gone = places_.find(id);
    if (gone == places_.end()) continue;
    for (const model::MapLandmark& landmark : gone->second.landmarks) submap_of_.erase(landmark.id);
    places_.erase(gone);
  }

  SubmapPlace place{submap.map_T_submap, submap.landmarks, {}};
  for (const model::MapLandmark& landmark : submap.landmarks) {
    comes_back(landmark.id);
    submap_of_[landmark.id] = submap.id;
    place.outline_m.push_back(landmark.position_m);
  }
  place.outline_m = convex_hull(std::move(place.outline_m));

  std::vector<model::MapLandmark> landmarks;
  append_in_map(place, landmarks);
  places_[submap.id] = std::move(place);
  return landmarks;
}

std::vector<model::MapLandmark> SubmapPlaces::take(const model::MapCorrection& correction) {
  std::vector<model::MapLandmark> landmarks;
  for (const model::SubmapPose& pose : correction.submaps) {
    const auto found = places_.find(pose.id);
    if (found == places_.end() || !has_moved(found->second.map_T_submap, pose.map_T_submap))
      continue;
    found->second.map_T_submap = pose.map_T_submap;
    append_in_map(found->second, landmarks);
  }
  return landmarks;
}

void SubmapPlaces::comes_back(model::LandmarkId id) {
  const auto found = submap_of_.find(id);
  if (found == submap_of_.end()) return;
  std::erase_if(places_.at(found->second).landmarks,
                [&](const model::MapLandmark& one) { return one.id == id; });
  if (places_.at(found->second).landmarks.empty()) places_.erase(found->second);
  submap_of_.erase(found);
}

void SubmapPlaces::clear() {
  places_.clear();
  submap_of_.clear();
}

}  // namespace understory::viewer
