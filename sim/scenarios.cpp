#include "sim/scenarios.hpp"

#include <algorithm>
#include <memory>

#include "sim/random_streams.hpp"

namespace understory::sim {
namespace {

/// Rotations on the spot become drivable curves; other paths only lose their jumps of curvature.
double rounding_m(PathKind kind) {
  switch (kind) {
    case PathKind::kSquare:
    case PathKind::kTriangle:
      return 11.0;
    case PathKind::kFigureEight:
    case PathKind::kMeander:
      return 5.0;
    default:
      return 1.0;
  }
}

std::vector<Eigen::Vector2d> waypoints(const ForestScenarioParameters& parameters) {
  PathParameters path;
  path.kind = parameters.path;
  path.length_m = parameters.length_m;
  path.interval = 0.5;
  const std::vector<geometry::SE2> poses = make_path(path);
  std::vector<Eigen::Vector2d> points;
  for (int lap = 0; lap < parameters.laps; ++lap) {
    for (const geometry::SE2& pose : poses) points.push_back(pose.translation());
  }
  if (parameters.laps > 1) points.push_back(poses.front().translation());
  return points;
}

Scenario in_forest(const ForestScenarioParameters& parameters, const Forest& forest,
                   const Route& route, std::uint64_t seed) {
  std::mt19937_64 random = random_stream(seed, Stream::kScenery);
  const std::vector<Eigen::Vector2d> path = route.places(0.5);
  return {std::make_shared<const World>(make_forest_world(forest, parameters.world, path, random)),
          route};
}

}  // namespace

Scenario forest_scenario(const ForestScenarioParameters& parameters, std::uint64_t seed) {
  const Route route = Route::through(waypoints(parameters), rounding_m(parameters.path));
  Eigen::Vector2d low = route.at(0.0).position_m;
  Eigen::Vector2d high = low;
  for (const Eigen::Vector2d& p : route.places(1.0)) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  ForestParameters forest = parameters.forest;
  forest.side_m = (high - low).maxCoeff() + 2.0 * parameters.margin_m;
  std::mt19937_64 random = random_stream(seed, Stream::kForest);
  const Eigen::Vector2d shift = Eigen::Vector2d::Constant(0.5 * forest.side_m) - 0.5 * (low + high);
  return in_forest(parameters, make_forest(forest, random), route.moved({shift, 0.0}), seed);
}

Scenario forest_scenario(const ForestScenarioParameters& parameters, const Forest& forest,
                         const geometry::SE2& world_T_start, std::uint64_t seed) {
  const Route route = Route::through(waypoints(parameters), rounding_m(parameters.path));
  return in_forest(parameters, forest, route.moved(world_T_start), seed);
}

}  // namespace understory::sim
