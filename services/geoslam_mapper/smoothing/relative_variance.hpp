// Uncertainty of landmarks relative to the vehicle.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Reference of the landmarks' errors: a node, and the number of keyframes when it was new.
struct Reference {
  NodeIndex node = 0;
  std::uint32_t keyframe = 0;
};

/// Whether the landmark was last observed within `recent_keyframes` of the reference, with all
/// keyframes between the two tied by landmarks: then it shares the error of that node.
bool is_recent(const StoredLandmark& landmark, const Reference& reference, int recent_keyframes,
               const Trajectory& trajectory);

/// Variance [m^2, per axis] of each landmark's position relative to the reference. Recent landmarks
/// (is_recent()) have their local variance. For the others (at a loop) the graph's joint covariance
/// is computed, exactly for at most eight that are spread out; each other one takes the value of
/// its nearest of these, by position and by the path length of its last observation. All local
/// without a reference.
std::vector<double> relative_variances(const std::vector<model::LandmarkId>& ids,
                                       const std::optional<Reference>& reference,
                                       int recent_keyframes, const GlobalMap& map);

}  // namespace understory::geoslam_mapper::smoothing
