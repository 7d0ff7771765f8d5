#include "sim/forest_world.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/point_grid.hpp"
#include "sim/random_streams.hpp"

namespace understory::sim {
namespace {

using std::numbers::pi;

double normal(std::mt19937_64& random, double sigma) {
  return sigma > 0.0 ? std::normal_distribution<double>(0.0, sigma)(random) : 0.0;
}

void add_branches(World& world, const Stem& trunk, double up_to_m, double mean_count,
                  std::mt19937_64& random) {
  if (mean_count <= 0.0 || up_to_m < 1.2) return;
  const int count = std::poisson_distribution<int>(mean_count)(random);
  for (int i = 0; i < count; ++i) {
    const double along = uniform(random, 1.0, up_to_m) + 0.5;
    const double bearing = uniform(random, -pi, pi);
    const double climb = uniform(random, -0.2, 0.7);

    Stem branch;
    branch.base_m = trunk.centre_at(along);
    branch.axis = Eigen::Vector3d(std::cos(bearing), std::sin(bearing), climb).normalized();
    branch.length_m = uniform(random, 0.4, 1.8);
    branch.base_radius_m = std::min(0.03, 0.3 * trunk.base_radius_m);
    branch.taper = 0.8 * branch.base_radius_m / branch.length_m;
    world.add(ObjectClass::kBranch, branch);
  }
}

void add_people(World& world, std::span<const Eigen::Vector2d> path_m, int count,
                std::mt19937_64& random) {
  for (int i = 0; i < count && !path_m.empty(); ++i) {
    const auto place = std::uniform_int_distribution<std::size_t>(0, path_m.size() - 1)(random);
    const double bearing = uniform(random, -pi, pi);
    const double aside = uniform(random, 3.0, 12.0);
    Walker walker;
    walker.middle_m.head<2>() =
        path_m[place] + aside * Eigen::Vector2d(std::cos(bearing), std::sin(bearing));
    walker.middle_m.z() = world.ground().height(walker.middle_m.head<2>());
    const double walk = uniform(random, -pi, pi);

    if (i % 3 != 0) walker.reach_m = 2.0 * Eigen::Vector2d(std::cos(walk), std::sin(walk));
    walker.speed_mps = uniform(random, 0.5, 1.4);
    walker.phase_rad = uniform(random, -pi, pi);
    world.add(walker);
  }
}

}  // namespace

double draw_radius_m(const ForestWorldParameters& parameters, std::mt19937_64& random) {
  const double radius =
      parameters.radius_median_m * std::exp(normal(random, parameters.radius_log_sigma));
  return std::clamp(radius, parameters.least_radius_m, parameters.greatest_radius_m);
}

void plant_tree(World& world, const Eigen::Vector2d& at_m, double radius_m, double crown_base_m,
                const ForestWorldParameters& parameters, std::mt19937_64& random) {
  const double height_m =
      std::clamp(6.0 + 70.0 * radius_m + normal(random, 1.5), crown_base_m + 3.0, 28.0);
  const double lean_x = normal(random, parameters.lean_sigma_rad);
  const Eigen::Vector2d lean(lean_x, normal(random, parameters.lean_sigma_rad));

  // Not thinner than 1 cm at the top.
  const double taper =
      std::min(parameters.taper * uniform(random, 0.6, 1.4), (radius_m - 0.01) / height_m);
  world.add_trunk(ObjectClass::kTrunk, at_m, radius_m, height_m, taper, lean);
  const double ground_m = world.ground().height(at_m);
  Foliage crown;
  crown.half_height_m = 0.5 * (height_m + 0.5 - crown_base_m);
  crown.level_radius_m = std::clamp(8.0 * radius_m + normal(random, 0.3), 0.8, 3.5);
  const double middle_m = crown_base_m + crown.half_height_m;

  crown.centre_m << at_m + middle_m * lean, ground_m + middle_m;
  crown.density_per_m = parameters.crown_density_per_m;
  world.add(ObjectClass::kCrown, crown);
  Stem trunk;
  trunk.base_m << at_m - 1.8 * lean, ground_m - 0.5;
  trunk.axis = Eigen::Vector3d(lean.x(), lean.y(), 1.0).normalized();
  trunk.base_radius_m = radius_m;

  add_branches(world, trunk, crown_base_m, parameters.branches_per_trunk, random);
}

void plant_bush(World& world, const Eigen::Vector2d& at_m, double density_per_m,
                std::mt19937_64& random) {
  Foliage bush;
  bush.level_radius_m = uniform(random, 0.3, 1.3);
  bush.half_height_m = bush.level_radius_m * uniform(random, 0.5, 1.1);
  bush.centre_m << at_m, world.ground().height(at_m) + 0.7 * bush.half_height_m;
  bush.density_per_m = density_per_m;
  world.add(ObjectClass::kBush, bush);
}

World make_forest_world(const Forest& forest, const ForestWorldParameters& parameters,
                        std::span<const Eigen::Vector2d> path_m, std::mt19937_64& random) {
  World world(Ground(parameters.ground, random));
  const PointGrid path(path_m, 20.0);
  for (std::size_t i = 0; i < forest.trunks_m.size(); ++i) {
    const double known_m = forest.radii_m[i];
    const double radius_m = known_m > 0.0 ? known_m : draw_radius_m(parameters, random);
    if (path.any_within(forest.trunks_m[i], parameters.clearance_m + radius_m)) continue;
    const double crown_base_m = parameters.crown_base_m * uniform(random, 0.7, 1.3);
    plant_tree(world, forest.trunks_m[i], radius_m, crown_base_m, parameters, random);
  }

  const Eigen::Vector2d size = forest.high_m - forest.low_m;
  const auto bushes = static_cast<int>(1e-4 * size.x() * size.y() * parameters.bushes_per_hectare);
  for (int i = 0; i < bushes; ++i) {
    const double x = uniform(random, forest.low_m.x(), forest.high_m.x());
    const Eigen::Vector2d at_m(x, uniform(random, forest.low_m.y(), forest.high_m.y()));
    if (path.any_within(at_m, parameters.clearance_m + 1.3)) continue;
    plant_bush(world, at_m, parameters.bush_density_per_m, random);
  }

  add_people(world, path_m, parameters.people, random);
  return world;
}

}  // namespace understory::sim
