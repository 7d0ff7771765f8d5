// A simulated street grid as a graph: closures of all ages, as many poses as one likes.
#pragma once

#include <cstdint>

#include "common/factor_graph/files/graph_file.hpp"

namespace understory::eval::experiments::backend {

struct WorldParameters {
  int poses = 20000;
  int steps_per_block = 5;  ///< A step is one metre; turns only at corners.
  /// Standard deviations of the motions (per step) and of what is seen of earlier poses.
  double motion_m = 0.05, motion_rad = 0.01;
  double closure_m = 0.05, closure_rad = 0.01;
  double closure_chance = 0.5;  ///< At a place where one has been.
};

/// A random walk through a square of streets that is passed a few times on average, measured with
/// noise of the stated deviations. No estimates: they come with the measurements.
factor_graph::files::GraphFile make_world(const WorldParameters& parameters, std::uint64_t seed);

}  // namespace understory::eval::experiments::backend
