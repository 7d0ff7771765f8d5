// Differences between two versions of the map, and parts of it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/model/slam_output.hpp"
#include "understory/map_request_t.hpp"

namespace understory::geoslam_mapper {

/// How far a landmark may be off in the map of a subscriber before it is told again: a quarter of
/// the standard deviation that was told of it, but at least `moved_m` and at most 2 cm where the
/// vehicle is, 10 cm farther away than it sees.
struct MapTolerance {
  double moved_m = 0.0;
  Eigen::Vector2d vehicle_m = Eigen::Vector2d::Zero();  ///< Frame map.
};

/// What leads from `before` to the map with `changed`, both in order of id: the landmarks that are
/// new, have moved or are around the vehicle. Those that are gone must be in `update.merged` or
/// `update.removed`. A subscriber is within the tolerance of the mapper. O(changed * log(map)).
model::MapDelta map_change(const std::vector<model::MapLandmark>& before,
                           const std::vector<model::MapLandmark>& changed,
                           const model::MapUpdate& update, const MapTolerance& tolerance);

/// Whether the change displaces most landmarks of `before` (in order of id) by more than
/// `distance_m`: the map as a whole has jumped. O(moved * log(map)).
bool displaces_most(const std::vector<model::MapLandmark>& before, const model::MapDelta& delta,
                    double distance_m);

/// Removes from a map what lies outside the bounds that the request gives. O(map).
void cut_to(const map_request_t& request, model::WholeMap& map);

}  // namespace understory::geoslam_mapper
