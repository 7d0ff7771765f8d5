// Uncertainty of landmarks relative to the vehicle.
#pragma once

#include <vector>

#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Whether the landmark was observed within the last `recent_keyframes`: it shares the vehicle's
/// error.
bool is_recent(const StoredLandmark& landmark, const GlobalMap& map, int recent_keyframes);

/// Variance [m^2, per axis] of each landmark's position relative to the last accepted keyframe.
/// Landmarks observed within `recent_keyframes` share the vehicle's error: theirs is the local one.
/// For the others (a loop is closing) the graph's joint covariance is asked, exactly for at most
/// eight that are spread out; the rest take that of their nearest one.
std::vector<double> relative_variances(const std::vector<model::LandmarkId>& ids,
                                       const GlobalMap& map, int recent_keyframes);

}  // namespace understory::geoslam_mapper::smoothing
