// Finds the place of one scan in a map of identical trees, without a prior.
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "common/constellation/map.hpp"
#include "common/geometry/se2.hpp"

namespace {

using understory::constellation::ConstellationMap;
using understory::constellation::Localisation;
using understory::constellation::ObservedPoint;
using understory::geometry::SE2;

constexpr double kSide_m = 200.0;
constexpr double kRange_m = 20.0;
constexpr double kSigma_m = 0.05;
constexpr int kTrees = 1500;

/// The trees within the sensor's range, in its frame, with noise.
std::vector<ObservedPoint> observe(const ConstellationMap& map, const SE2& map_T_sensor,
                                   std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, kSigma_m);
  std::vector<ObservedPoint> points;
  for (const auto id : map.near({map_T_sensor.translation(), kRange_m})) {
    const Eigen::Vector2d seen = map_T_sensor.inverse() * *map.position(id);
    points.push_back({seen + Eigen::Vector2d(noise(random), noise(random)), kSigma_m});
  }
  return points;
}

}  // namespace

int main() {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> anywhere(0.0, kSide_m);
  ConstellationMap map;
  for (int id = 1; id <= kTrees; ++id) map.insert(id, {anywhere(random), anywhere(random)});

  const SE2 truth(120.0, 75.0, 0.7);
  const std::vector<ObservedPoint> points = observe(map, truth, random);
  const Localisation place = map.localise(points);
  if (!place.found()) {
    std::puts("not sure");
    return 1;
  }

  const double error_m = (place.map_T_sensor.translation() - truth.translation()).norm();
  std::printf(
      "%zu trees in view, %u matched: pose (%.2f m, %.2f m, %.3f rad), %.3f m from the truth\n",
      points.size(), place.inliers, place.map_T_sensor.x(), place.map_T_sensor.y(),
      place.map_T_sensor.theta(), error_m);
  return error_m < 0.1 ? 0 : 1;
}
