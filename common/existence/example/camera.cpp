// Example: existence of map points in a visual SLAM; one page, Eigen alone.
//   existence-camera
// A camera drives past a wall with 200 keypoints. It comes back a month later: a quarter of the
// wall was repainted, and a van hides another quarter. Repainted points are removed, hidden points
// stay.
#include <cstdio>
#include <random>
#include <vector>

#include "common/existence/icosahedral_shell.hpp"
#include "common/existence/point.hpp"

using namespace understory::existence;

namespace {

/// A map point of the SLAM and its existence.
struct MapPoint {
  Eigen::Vector3f position_m;
  PointExistence<IcosahedralShell> existence;
};

/// Pinhole of 90 degrees that looks along +y from the camera's centre.
bool is_in_frustum(const Eigen::Vector3f& camera_m, const Eigen::Vector3f& point_m) {
  const Eigen::Vector3f ray = point_m - camera_m;
  return ray.y() > 0.5F && std::abs(ray.x()) < ray.y() && std::abs(ray.z()) < 0.75F * ray.y();
}

/// One drive past the wall on three parallel tracks. `matches(i)`: whether the tracker matched map
/// point i in this frame; in a SLAM this is the result of descriptor matching.
template <typename Matches>
void drive_past(ExistenceModel& model, std::vector<MapPoint>& map, const Matches& matches) {
  model.begin_pass();
  for (const float aside_m : {0.0F, 4.0F, 8.0F}) {
    for (float x_m = -5.0F; x_m < 25.0F; x_m += 0.5F) {
      const Eigen::Vector3f camera_m(x_m, -aside_m, 1.5F);
      for (std::size_t i = 0; i < map.size(); ++i) {
        if (!is_in_frustum(camera_m, map[i].position_m)) continue;  // not expected: no evidence
        const Look look{camera_m - map[i].position_m};
        if (matches(i, camera_m))
          map[i].existence.hit(model, look);
        else
          map[i].existence.miss(model, look);
      }
    }
  }
}

}  // namespace

int main() {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  Parameters parameters;
  parameters.range_m = 30.0;
  parameters.decay_per_s = 1e-7;  // 1 % of the points per day
  ExistenceModel model(parameters);

  // The SLAM triangulates its points: each is born at its first sighting.
  std::vector<MapPoint> map;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3f position_m(20.0F * unit(random), 6.0F, 3.0F * unit(random));
    const Look first{Eigen::Vector3f(position_m.x(), 0.0F, 1.5F) - position_m};
    map.push_back({position_m, PointExistence<IcosahedralShell>::born(model, first)});
  }
  const auto detects = [&] { return unit(random) < 0.85F; };
  drive_past(model, map, [&](std::size_t, const Eigen::Vector3f&) { return detects(); });

  // A month later: the same map, the world has changed.
  for (MapPoint& point : map) point.existence.elapse(model, model.elapsed(30.0 * 86400.0));
  drive_past(model, map, [&](std::size_t i, const Eigen::Vector3f& camera_m) {
    const float x_m = map[i].position_m.x();
    const bool is_repainted = x_m < 5.0F;
    const bool is_behind_van = x_m > 15.0F && camera_m.x() < x_m + 1.0F;  // seen from one side only
    return !is_repainted && !is_behind_van && detects();
  });

  int removed = 0, wrongly = 0;
  for (const MapPoint& point : map) {
    if (point.existence.probability() > 0.5) continue;
    ++removed;
    wrongly += point.position_m.x() < 5.0F ? 0 : 1;
  }
  std::printf("%d of %zu points removed, %d of them wrongly\n", removed, map.size(), wrongly);
  return wrongly == 0 && removed > 0 ? 0 : 1;
}
