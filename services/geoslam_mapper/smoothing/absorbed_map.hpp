// Joins an earlier map to the map in use.
#pragma once

#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Adds all of another map to this one: landmarks with their ids, nodes, measurements, keyframes.
/// Landmarks that were given to the other map count as observed from its origin. The two are tied
/// only by a motion of negligible information, `kAbsorbing`, which must be removed once they are
/// joined. The graph is solved. Returns the ids of the landmarks, ascending. Cost: the size of the
/// other map.
std::vector<model::LandmarkId> absorb(GlobalMap other, const geometry::SE2& map_T_other,
                                      GlobalMap& map);
/// Id of that motion among the loop closures.
inline constexpr std::uint64_t kAbsorbing = ~std::uint64_t{0};

}  // namespace understory::geoslam_mapper::smoothing
