#include "services/viewer/shown_scan.hpp"

#include <algorithm>
#include <cmath>

namespace understory::viewer {
namespace {

constexpr std::size_t kMostScanPoints = 20'000;

}  // namespace

void ShownScan::take(const model::LandmarkScan& scan) {
  SceneScan& now = scan_.changed(*changes_);
  now.utime = scan.utime;
  now.detections = scan.detections;
}

void ShownScan::take(const model::PlanarScan& scan, const geometry::SE2& vehicle_T_sensor) {
  SceneScan& now = scan_.changed(*changes_);
  now.utime = scan.utime;
  now.points_m.clear();
  for (std::size_t beam = 0; beam < scan.ranges_m.size(); ++beam) {
    if (!scan.is_return(beam)) continue;
    const double range_m = scan.ranges_m[beam];
    const Eigen::Vector2d point =
        vehicle_T_sensor * Eigen::Vector2d(range_m * std::cos(scan.bearing(beam)),
                                           range_m * std::sin(scan.bearing(beam)));
    now.points_m.push_back({static_cast<float>(point.x()), static_cast<float>(point.y()), 0.0F});
  }
}

void ShownScan::take(const model::PointSweep& part) {
  SceneScan& now = scan_.changed(*changes_);
  if (part.revolution != revolution_) now.points_m.clear();
  revolution_ = part.revolution;
  now.utime = part.utime;
  // Of many points every n-th: a page shows only the shape.
  const std::size_t step =
      1 + part.points.size() * std::max<std::size_t>(1, part.parts) / kMostScanPoints;
  for (std::size_t i = 0; i < part.points.size(); i += step)
    now.points_m.push_back({part.points[i].x_m, part.points[i].y_m, part.points[i].z_m});
}

}  // namespace understory::viewer
