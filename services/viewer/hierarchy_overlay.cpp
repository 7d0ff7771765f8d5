#include "services/viewer/hierarchy_overlay.hpp"

#include <algorithm>

#include "common/hierarchy/geometric_hierarchy.hpp"

namespace understory::viewer {
namespace {

constexpr double kReach_m = 60.0;
constexpr std::size_t kMost = 600;

}  // namespace

HierarchyOverlay hierarchy_around_vehicle(const Scene& scene) {
  HierarchyOverlay overlay;
  if (!scene.pose().value) return overlay;
  const Eigen::Vector2d centre = scene.pose().value->map_T_vehicle().translation();

  std::vector<std::pair<double, hierarchy::LandmarkPosition>> near;
  for (Slot slot = 0; slot < scene.landmarks().slots().size(); ++slot) {
    const SceneLandmark& one = scene.landmarks().slots()[slot];
    if ((one.flags & SceneLandmark::kThere) == 0 || (one.flags & SceneLandmark::kOutOfUse) != 0)
      continue;
    const Eigen::Vector2d place(one.x_m, one.y_m);
    const double distance_m = (place - centre).norm();
    if (distance_m < kReach_m) near.push_back({distance_m, {slot, place}});
  }
  if (near.size() > kMost) {
    std::ranges::nth_element(near, near.begin() + kMost, {},
                             [](const auto& one) { return one.first; });
    near.resize(kMost);
  }

  std::vector<hierarchy::LandmarkPosition> landmarks;
  landmarks.reserve(near.size());
  for (const auto& [distance_m, landmark] : near) landmarks.push_back(landmark);
  for (const hierarchy::HierarchyEdge& edge :
       hierarchy::edges(hierarchy::GeometricHierarchy(landmarks))) {
    overlay.from.push_back(static_cast<std::uint32_t>(edge.from_id));
    overlay.to.push_back(static_cast<std::uint32_t>(edge.to_id));
    overlay.level.push_back(edge.in_polygon_boundary ? 1 : 0);
  }
  return overlay;
}

}  // namespace understory::viewer
