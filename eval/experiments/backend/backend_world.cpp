#include "eval/experiments/backend/backend_world.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

namespace understory::eval::experiments::backend {
namespace {

constexpr int kPassesPerStreet = 4;
constexpr int kClosureAge = 20;  ///< What was there a moment ago is motion.
constexpr std::array<std::pair<int, int>, 4> kSteps{{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};

struct Place {
  int x = 0, y = 0;
  int heading = 0;  ///< In quarters of a full rotation.

  geometry::SE2 pose() const { return {double(x), double(y), 0.5 * std::numbers::pi * heading}; }
};

/// The square's side, in blocks: a block has two streets of its own.
int side_in_blocks(const WorldParameters& parameters) {
  const double streets = static_cast<double>(parameters.poses) / kPassesPerStreet;
  return std::max(
      1, static_cast<int>(std::lround(std::sqrt(streets / (2.0 * parameters.steps_per_block)))));
}

std::vector<Place> walk(const WorldParameters& parameters, std::mt19937_64& random) {
  const int side = parameters.steps_per_block * side_in_blocks(parameters);
  std::uniform_int_distribution<int> turn(-1, 1);
  std::vector<Place> places{Place{}};

  while (static_cast<int>(places.size()) < parameters.poses) {
    Place next = places.back();
    const bool at_corner =
        next.x % parameters.steps_per_block == 0 && next.y % parameters.steps_per_block == 0;
    if (at_corner) next.heading = (next.heading + turn(random) + 4) % 4;

    const auto [dx, dy] = kSteps[static_cast<std::size_t>(next.heading)];
    const bool leaves =
        next.x + dx < 0 || next.y + dy < 0 || next.x + dx > side || next.y + dy > side;
    if (leaves) {
      // Beyond the edge of the town: try another heading.
      places.back().heading = (places.back().heading + 1) % 4;
      continue;
    }

    next.x += dx;
    next.y += dy;
    places.push_back(next);
  }
  return places;
}

factor_graph::graph::Factor measured(int a, int b, const std::vector<Place>& places, double sigma_m,
                                     double sigma_rad, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const geometry::SE2 truth = places[static_cast<std::size_t>(a)].pose().inverse() *
                              places[static_cast<std::size_t>(b)].pose();
  const double dx = sigma_m * normal(random);
  const double dy = sigma_m * normal(random);
  const geometry::SE2 noise(dx, dy, sigma_rad * normal(random));
  const double per_m = 1.0 / (sigma_m * sigma_m);
  const double per_rad = 1.0 / (sigma_rad * sigma_rad);
  return relative(factor_graph::graph::VariableId(a), factor_graph::graph::VariableId(b),
                  truth * noise, Eigen::Vector3d(per_m, per_m, per_rad).asDiagonal());
}

}  // namespace

factor_graph::files::GraphFile make_world(const WorldParameters& parameters, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const std::vector<Place> places = walk(parameters, random);
  factor_graph::files::GraphFile graph;
  std::map<std::pair<int, int>, std::vector<int>> visits;
  std::bernoulli_distribution is_seen(parameters.closure_chance);

  for (int k = 0; k < static_cast<int>(places.size()); ++k) {
    const Place& place = places[static_cast<std::size_t>(k)];
    graph.vertices.push_back({k, factor_graph::graph::VariableType::kPose2, {}, false});
    if (k > 0) {
      graph.factors.push_back(
          measured(k - 1, k, places, parameters.motion_m, parameters.motion_rad, random));
    }

    std::vector<int>& earlier = visits[{place.x, place.y}];
    if (!earlier.empty() && k - earlier.back() > kClosureAge && is_seen(random)) {
      std::uniform_int_distribution<std::size_t> any(0, earlier.size() - 1);
      graph.factors.push_back(measured(earlier[any(random)], k, places, parameters.closure_m,
                                       parameters.closure_rad, random));
    }
    earlier.push_back(k);
  }
  return graph;
}

}  // namespace understory::eval::experiments::backend
