// A 3-D forest for real sensors: trunks with crowns and branches, and undergrowth.
#pragma once

#include <Eigen/Core>
#include <random>
#include <span>

#include "sim/forest.hpp"
#include "sim/ground.hpp"
#include "sim/world.hpp"

namespace understory::sim {

/// Shapes and densities of the plants.
struct ForestWorldParameters {
  GroundParameters ground{
      .slope = {0.03, -0.02}, .relief_m = 0.5, .roughness_m = 0.025, .cover_m = 0.02};
  double radius_median_m = 0.14;   ///< At breast height, if the forest gives none.
  double radius_log_sigma = 0.45;  ///< Of the logarithm.
  double least_radius_m = 0.05;
  double greatest_radius_m = 0.5;
  double taper = 0.008;          ///< Mean loss of radius per metre.
  double lean_sigma_rad = 0.03;  ///< Per axis.
  double crown_base_m = 4.0;     ///< Mean height of the crown's base; +- 30 %.
  double crown_density_per_m = 0.5;
  double branches_per_trunk = 2.0;  ///< Dead ones below the crown.
  double bushes_per_hectare = 80.0;
  double bush_density_per_m = 2.5;
  int people = 0;            ///< Walkers along the path.
  double clearance_m = 2.0;  ///< Plants keep this distance from the path.
};

/// The forest's trunks (except on the path, `path_m`: points about a metre apart) with crowns and
/// branches, and bushes and people between them. Trunk i of World::trunks() is the i-th remaining
/// one.
World make_forest_world(const Forest& forest, const ForestWorldParameters& parameters,
                        std::span<const Eigen::Vector2d> path_m, std::mt19937_64& random);

/// Adds a trunk with crown and branches; `crown_base_m` above the ground. (Also for streets and
/// fields.)
void plant_tree(World& world, const Eigen::Vector2d& at_m, double radius_m, double crown_base_m,
                const ForestWorldParameters& parameters, std::mt19937_64& random);
/// Adds a bush, low and round, on the ground.
void plant_bush(World& world, const Eigen::Vector2d& at_m, double density_per_m,
                std::mt19937_64& random);
/// Radius at breast height of a random trunk.
double draw_radius_m(const ForestWorldParameters& parameters, std::mt19937_64& random);

}  // namespace understory::sim
