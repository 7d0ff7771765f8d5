// The way round a block.
#pragma once

#include "common/geometry/se2.hpp"

namespace understory::eval::harness {

/// The pose after `along_m` of laps to the left round a rectangle with sides of `straight_m` (first
/// along x) between corners that are arcs of `corner_m`; from the beginning of the first side.
geometry::SE2 on_block(double along_m, const Eigen::Vector2d& straight_m, double corner_m);
/// Length of a lap [m].
double block_length_m(const Eigen::Vector2d& straight_m, double corner_m);

}  // namespace understory::eval::harness
