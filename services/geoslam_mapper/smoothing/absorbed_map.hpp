// A map that was left, as part of the map in use.
#pragma once

#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Adds all of another map to this one: landmarks under their ids, nodes, what was measured of
/// them, keyframes. What was given to the other map counts as observed from its origin. Nothing
/// ties the two yet but a motion that hardly counts, `kAbsorbing`, which is to be taken out once
/// they are joined. The graph is solved. Returns the ids of the landmarks, ascending. Cost: the
/// other map.
std::vector<model::LandmarkId> absorb(GlobalMap other, const geometry::SE2& map_T_other,
                                      GlobalMap& map);
/// Number of that motion among the loop closures.
inline constexpr std::uint64_t kAbsorbing = ~std::uint64_t{0};

}  // namespace understory::geoslam_mapper::smoothing
