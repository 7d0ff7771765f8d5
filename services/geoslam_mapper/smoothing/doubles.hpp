// Landmarks that are the same, found by where they are.
#pragma once

#include <span>
#include <vector>

#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/merges.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Merges landmarks that are one by all that is known of their distance. The joint covariance must
/// tell neighbours apart, and the two must not have been observed side by side. Then they are one
/// where two trunks would touch, or where that is much likelier than two neighbours: of which two
/// passes saw one each, by their distance in its covariance, by how dense landmarks stand around,
/// and by how many of these both passes saw; or that were seen on one way past them, by who saw
/// which and by their distance, which bad scans may have moved. Of two that touch and whose
/// distance contradicts its covariance, what the one that was seen less was observed as does not
/// count: one thing, but no point. Where the covariance is large, only the neighbourhood as a whole
/// can tell: PassJoiner. Looks around the landmarks of `ids`, up to `merge_distance_m`. The graph
/// is not solved. Returns the merged pairs.
std::vector<MergedPair> merge_doubles(std::span<const model::LandmarkId> ids,
                                      const SmoothingMapperParameters& parameters, Merges& merges,
                                      GlobalMap& map);

}  // namespace understory::geoslam_mapper::smoothing
