// A simulated street grid as a graph: closures of all ages, any number of poses.
#pragma once

#include <cstdint>

#include "common/factor_graph/files/graph_file.hpp"

namespace understory::eval::experiments::backend {

/// Size and noise of the simulated street grid.
struct WorldParameters {
  int poses = 20000;
  int steps_per_block = 5;  ///< A step is one metre; the heading changes only at corners.
  /// Standard deviations of the motions (per step) and of closures with earlier poses.
  double motion_m = 0.05, motion_rad = 0.01;
  double closure_m = 0.05, closure_rad = 0.01;
  double closure_chance = 0.5;  ///< At a place that was visited before.
};

/// A random walk through a square of streets that is passed a few times on average, measured with
/// noise of the stated deviations. No estimates: they come with the measurements.
factor_graph::files::GraphFile make_world(const WorldParameters& parameters, std::uint64_t seed);

}  // namespace understory::eval::experiments::backend
