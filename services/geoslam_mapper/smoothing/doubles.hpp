// Finds landmarks that are one trunk by their positions.
#pragma once

#include <span>
#include <vector>

#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/merges.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Merges two landmarks that are one trunk according to their distance and its covariance.
/// Conditions: the joint covariance resolves neighbouring trunks, and no node observed the two side
/// by side. Then they are merged if they touch, or if one trunk is much more likely than two. If
/// each of two passes saw one of them, the likelihood depends on their distance and its covariance,
/// the density of landmarks around, and the share of these that both passes saw. If they were seen
/// on one way past them, it depends on the nodes that observed each and on their distance, which
/// bad scans may have changed. If two touch but their distance contradicts its covariance, the
/// observations of the less observed one are ignored: it is one object, but no point. With a large
/// covariance only the whole neighbourhood can decide: PassJoiner. Searches around the landmarks of
/// `ids`, up to `merge_distance_m`. The graph is not solved. Returns the merged pairs.
std::vector<MergedPair> merge_doubles(std::span<const model::LandmarkId> ids,
                                      const SmoothingMapperParameters& parameters, Merges& merges,
                                      GlobalMap& map);

}  // namespace understory::geoslam_mapper::smoothing
