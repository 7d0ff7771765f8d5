// Town and country scenarios of sim/scenarios.hpp.
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "sim/random_streams.hpp"
#include "sim/scenarios.hpp"
#include "sim/street_world.hpp"

namespace understory::sim {
namespace {

/// Of a recorded trajectory: the construction of a route stores a point every 0.1 m, 160 MB for
/// this length.
constexpr double kLongestTrajectoryM = 1e6;

using Points = std::vector<Eigen::Vector2d>;
constexpr double kRounding = 11.0;

Scenario along_streets(const Route& route, const std::vector<Stretch>& stretches,
                       std::uint64_t seed) {
  std::mt19937_64 random = random_stream(seed, Stream::kScenery);
  return {std::make_shared<const World>(
              make_street_world(route, stretches, StreetWorldParameters{}, random)),
          route};
}

/// A country road: gentle bends of random curvature, occasionally a sharper one.
void append_country_road(Points& points, double heading_rad, double length_m,
                         std::mt19937_64& random) {
  const double step = 2.0;
  const double home_rad = heading_rad;  // keeps the path from crossing itself
  for (double driven = 0.0; driven < length_m;) {
    const double bend_m = uniform(random, 60.0, 220.0);
    const double straight_m = uniform(random, 0.0, 150.0);
    const double wish_rad = home_rad + uniform(random, -0.9, 0.9);
    const double rotation_rad = std::clamp(wish_rad - heading_rad, -bend_m / 45.0, bend_m / 45.0);

    const auto steps = static_cast<int>(std::lround((bend_m + straight_m) / step));
    for (int i = 0; i < steps; ++i) {
      if (i * step < bend_m) heading_rad += rotation_rad * step / bend_m;
      points.push_back(points.back() +
                       step * Eigen::Vector2d(std::cos(heading_rad), std::sin(heading_rad)));
    }
    driven += bend_m + straight_m;
  }
}

/// Random stretches of open country, until `length_m` is covered.
void append_country(std::vector<Stretch>& stretches, double length_m, std::mt19937_64& random) {
  for (double covered = 0.0; covered < length_m;) {
    const double chance = uniform(random, 0.0, 1.0);
    Stretch stretch;
    if (chance < 0.30) {
      stretch = {uniform(random, 80.0, 300.0), avenue_roadside()};
    } else if (chance < 0.60) {
      stretch = {uniform(random, 100.0, 350.0), wood_roadside()};
    } else if (chance < 0.85) {
      stretch = {uniform(random, 60.0, 250.0), field_roadside()};
    } else {
      stretch = {uniform(random, 80.0, 200.0), village_roadside()};
    }

    covered += stretch.length_m;
    stretches.push_back(stretch);
  }
}

/// The first `length_m` of the polyline.
Points shortened(const Points& points, double length_m) {
  Points result{points.front()};
  double driven = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Eigen::Vector2d leg = points[i] - points[i - 1];
    const double left_m = length_m - driven;
    driven += leg.norm();
    if (driven >= length_m) {
      result.emplace_back(points[i - 1] + left_m / leg.norm() * leg);
      break;
    }
    result.push_back(points[i]);
  }

  return result;
}

}  // namespace

Scenario urban_scenario(int laps, std::uint64_t seed, double overlap_m) {
  // 2 * (215 + 140) m minus the loss at the rounded corners, about 10 m.
  const Points corners{{0, 0}, {110, 0}, {110, 140}, {-105, 140}, {-105, 0}};
  Points points;
  for (int lap = 0; lap <= laps; ++lap) {
    points.insert(points.end(), corners.begin(), corners.end());
  }
  const double lap_m = 2.0 * (215.0 + 140.0);
  const Route route = Route::through(shortened(points, laps * lap_m + overlap_m), kRounding);
  // The world is that of one lap, whatever the number of laps.
  return along_streets(route, {{lap_m - 20.0, town_roadside()}, {1e9, Roadside{}}}, seed);
}

Scenario urban_to_countryside_scenario(double length_m, std::uint64_t seed) {
  std::mt19937_64 random = random_stream(seed, Stream::kStartPose);
  Points points{{0, 0}, {130, 0}, {130, 110}, {260, 110}, {260, 30}, {430, 30}, {520, 60}};
  const double town_m = 700.0;
  append_country_road(points, 0.3, std::max(0.0, length_m - town_m), random);
  const Route route = Route::through(shortened(points, length_m), kRounding);
  std::vector<Stretch> stretches{{town_m - 60.0, town_roadside()}, {180.0, village_roadside()}};
  append_country(stretches, length_m - town_m, random);
  return along_streets(route, stretches, seed);
}

Scenario countryside_scenario(double length_m, std::uint64_t seed) {
  std::mt19937_64 random = random_stream(seed, Stream::kStartPose);
  Points points{{0, 0}, {20, 0}};
  append_country_road(points, 0.0, length_m, random);
  const Route route = Route::through(shortened(points, length_m), kRounding);
  // Begins with landmarks: a filter needs them at the start.
  std::vector<Stretch> stretches{{120.0, avenue_roadside()}};
  append_country(stretches, length_m, random);
  return along_streets(route, stretches, seed);
}

ScenarioResult pole_map_scenario(std::string_view poles_csv, std::string_view trajectory_csv,
                                 std::uint64_t seed) {
  const StemMapResult poles = parse_stem_map(poles_csv);
  if (!poles.error.empty()) return {std::nullopt, "poles: " + poles.error};

  // A trajectory has the same columns.
  const StemMapResult path = parse_stem_map(trajectory_csv);
  if (!path.error.empty()) return {std::nullopt, "trajectory: " + path.error};

  // Positions scatter while the car stands.
  Points points{path.forest.trunks_m.front()};
  double length_m = 0.0;
  for (const Eigen::Vector2d& p : path.forest.trunks_m) {
    const double step_m = (p - points.back()).norm();
    if (step_m <= 0.7) continue;
    points.push_back(p);
    length_m += step_m;
  }
  if (length_m > kLongestTrajectoryM) return {std::nullopt, "trajectory: longer than 1000 km"};

  if (points.size() < 10) return {std::nullopt, "trajectory: less than 10 places 0.7 m apart"};
  const Route route = Route::through(points, 3.0);
  std::mt19937_64 random = random_stream(seed, Stream::kScenery);
  StreetWorldParameters parameters;
  parameters.clearance_m = 1.5;

  return {Scenario{std::make_shared<const World>(
                       make_pole_world(route, poles.forest, parameters, random)),
                   route},
          {}};
}

}  // namespace understory::sim
