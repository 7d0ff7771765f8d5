// Differences between two versions of the map, and parts of it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/model/slam_output.hpp"
#include "understory/map_request_t.hpp"

namespace understory::geoslam_mapper {

/// Largest error of a landmark in a subscriber's map before it is sent again: a quarter of the
/// standard deviation that was sent for it, but at least `moved_m` and at most 2 cm within
/// kAroundVehicle_m of the vehicle, 10 cm beyond.
struct MapTolerance {
  double moved_m = 0.0;
  Eigen::Vector2d vehicle_m = Eigen::Vector2d::Zero();  ///< Frame map.
};

/// The change from `before` to the map with `changed`, both in order of id: the landmarks that are
/// new, have moved or are around the vehicle. Removed landmarks must be in `update.merged` or
/// `update.removed`. With it a subscriber's map is within the tolerance. O(changed * log(map)).
model::MapDelta map_change(const std::vector<model::MapLandmark>& before,
                           const std::vector<model::MapLandmark>& changed,
                           const model::MapUpdate& update, const MapTolerance& tolerance);

/// Whether the change displaces most landmarks of `before` (in order of id) by more than
/// `distance_m`: a jump of the whole map. O(moved * log(map)).
bool displaces_most(const std::vector<model::MapLandmark>& before, const model::MapDelta& delta,
                    double distance_m);

/// Removes from a map the parts outside the bounds of the request. O(map).
void cut_to(const map_request_t& request, model::WholeMap& map);

}  // namespace understory::geoslam_mapper
