// Uncertainty of landmarks relative to the vehicle.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// What landmarks' errors are relative to: a node, and the number of keyframes when it was new.
struct Reference {
  NodeIndex node = 0;
  std::uint32_t keyframe = 0;
};

/// Whether the landmark was observed last within `recent_keyframes` of the reference, and landmarks
/// tie all keyframes between the two together: it shares the error of that node.
bool is_recent(const StoredLandmark& landmark, const Reference& reference, int recent_keyframes,
               const Trajectory& trajectory);

/// Variance [m^2, per axis] of each landmark's position relative to the reference. That
/// of landmarks that are recent (is_recent()) is the local one. For the
/// others (a loop is closing) the graph's joint covariance is asked, exactly for at most eight that
/// are spread out; the rest take that of their nearest one, in place and in the path of the vehicle
/// that saw them last. All local without a reference.
std::vector<double> relative_variances(const std::vector<model::LandmarkId>& ids,
                                       const std::optional<Reference>& reference,
                                       int recent_keyframes, const GlobalMap& map);

}  // namespace understory::geoslam_mapper::smoothing
