// Differences between two versions of the map.
#pragma once

#include <vector>

#include "common/model/slam_output.hpp"

namespace understory::geoslam_mapper {

/// What leads from `before` to `after`, both in order of id. Landmarks that moved by less than
/// `moved_m` are left out, and those that moved by less than a quarter of the standard deviation
/// that was told of them and by less than 2 cm: a subscriber is within that of the mapper; the old
/// ids of `update.merged` count as merged, not as removed. O(map).
model::MapDelta map_difference(const std::vector<model::MapLandmark>& before,
                               const std::vector<model::MapLandmark>& after,
                               const model::MapUpdate& update, double moved_m);

/// The same from those landmarks alone that are new or have moved, in order of id; those that are
/// gone must be in `update.merged` or `update.removed`. O(changed * log(map)).
model::MapDelta map_change(const std::vector<model::MapLandmark>& before,
                           const std::vector<model::MapLandmark>& changed,
                           const model::MapUpdate& update, double moved_m);

/// Whether the change displaces most landmarks of `before` (in order of id) by more than
/// `distance_m`: the map as a whole has jumped. O(moved * log(map)).
bool displaces_most(const std::vector<model::MapLandmark>& before, const model::MapDelta& delta,
                    double distance_m);

}  // namespace understory::geoslam_mapper
