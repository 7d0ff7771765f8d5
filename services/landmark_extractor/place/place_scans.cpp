#include "services/landmark_extractor/place/place_scans.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>

namespace understory::landmark_extractor::place {
namespace {

/// Bits for the number of a cube along one axis.
constexpr int kAxisBits = 20;

/// A point in its cube.
struct InCube {
  std::uint64_t cube = 0;
  float off = 0.0F;  ///< Squared distance from the cube's centre, for edges of 1.
  std::uint32_t index = 0;

  friend bool operator<(const InCube& a, const InCube& b) {
    return std::tie(a.cube, a.off, a.index) < std::tie(b.cube, b.off, b.index);
  }
};

InCube in_cube(const Eigen::Vector3f& position_m, float cube_m, std::uint32_t index) {
  const Eigen::Vector3f scaled = position_m / cube_m;
  const Eigen::Vector3f cell = scaled.array().floor();
  InCube result;
  for (int axis = 0; axis < 3; ++axis) {
    const auto number = static_cast<std::int64_t>(cell(axis)) + (1 << (kAxisBits - 1));
    result.cube = (result.cube << kAxisBits) | static_cast<std::uint64_t>(number);
  }
  result.off = (scaled - cell - Eigen::Vector3f::Constant(0.5F)).squaredNorm();
  result.index = index;
  return result;
}

bool counts(const Eigen::Vector3f& position_m, double range_m) {
  return position_m.allFinite() && position_m.head<2>().norm() <= static_cast<float>(range_m) &&
         position_m.cwiseAbs().maxCoeff() <= model::kMostDistantPlacePointM;
}

model::PlaceScan scan_at(model::Utime utime, const std::vector<Eigen::Vector3f>& points,
                         const PlaceScanParameters& parameters) {
  model::PlaceScan scan;
  scan.utime = utime;
  scan.points = down_sampled(points, parameters);
  return scan;
}

}  // namespace

std::vector<model::PlacePoint> down_sampled(const std::vector<Eigen::Vector3f>& points,
                                            const PlaceScanParameters& parameters) {
  // The best point of each cube.
  std::vector<InCube> cubes;
  cubes.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (counts(points[i], parameters.max_range_m))
      cubes.push_back(
          in_cube(points[i], static_cast<float>(parameters.cube_m), static_cast<std::uint32_t>(i)));
  }
  std::sort(cubes.begin(), cubes.end());
  const auto end = std::unique(cubes.begin(), cubes.end(),
                               [](const InCube& a, const InCube& b) { return a.cube == b.cube; });
  cubes.erase(end, cubes.end());

  // Beyond the limit, a uniform selection.
  const std::size_t kept = std::min(cubes.size(), static_cast<std::size_t>(parameters.most_points));
  std::vector<model::PlacePoint> result;
  result.reserve(kept);
  for (std::size_t i = 0; i < kept; ++i)
    result.push_back(model::place_point(points[cubes[i * cubes.size() / kept].index]));
  return result;
}

model::PlaceScan place_scan_of(const model::PointSweep& sweep,
                               const PlaceScanParameters& parameters) {
  Eigen::Matrix3f level_R_vehicle = Eigen::Matrix3f::Identity();
  if (sweep.attitude)
    level_R_vehicle = sweep.attitude->level_Q_vehicle.toRotationMatrix().cast<float>();
  std::vector<Eigen::Vector3f> points;
  points.reserve(sweep.points.size());
  for (const model::SweepPoint& point : sweep.points)
    points.emplace_back(level_R_vehicle * point.position());
  return scan_at(sweep.utime, points, parameters);
}

model::PlaceScan place_scan_of(const model::PlanarScan& scan,
                               const PlaceScanParameters& parameters) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(scan.ranges_m.size());
  for (std::size_t i = 0; i < scan.ranges_m.size(); ++i) {
    if (!scan.is_return(i)) continue;
    const double range_m = scan.ranges_m[i];
    const double bearing_rad = scan.bearing(i);
    const Eigen::Vector2d at =
        scan.vehicle_T_sensor *
        Eigen::Vector2d(range_m * std::cos(bearing_rad), range_m * std::sin(bearing_rad));
    points.emplace_back(static_cast<float>(at.x()), static_cast<float>(at.y()), 0.0F);
  }
  return scan_at(scan.utime, points, parameters);
}

bool PlaceScans::is_due(model::Utime utime) const {
  if (parameters_.period_s <= 0.0) return false;
  const double since_s = last_ ? 1e-6 * static_cast<double>(utime - *last_) : 0.0;
  return !last_ || since_s < 0.0 || since_s >= parameters_.period_s;
}

}  // namespace understory::landmark_extractor::place
