// Thinned forests, with few trunks per scan.
#pragma once

#include <cstdint>
#include <span>

#include "common/geometry/se2.hpp"
#include "common/model/landmarks.hpp"
#include "sim/forest.hpp"

namespace understory::sim {

/// The forest without trunks nearer than `spacing_m` to a remaining one; which of two remains is
/// random. Cost: the neighbours within `spacing_m` of all trunks.
Forest thinned(const Forest& forest, double spacing_m, std::uint64_t seed);

/// Mean number of trunks in view of the poses (world_T_vehicle); 0 without poses.
double mean_in_view(const Forest& forest, std::span<const geometry::SE2> poses,
                    const model::FieldOfView& view);

/// The forest thinned by the spacing at which the poses have about `wanted` trunks in view on
/// average; unchanged if it has no more than that.
Forest thinned_to(double wanted, const Forest& forest, std::span<const geometry::SE2> poses,
                  const model::FieldOfView& view, std::uint64_t seed);

}  // namespace understory::sim
