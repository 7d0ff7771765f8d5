// Merging of landmarks that are the same.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Merges landmarks nearer than `merge_distance_m` to each other that were not observed side by
/// side: the one with fewer observations into the other. Its observations keep counting where they
/// agree with the other's position within the noise. Looks only around the landmarks of `touched`.
/// Returns (old id, new id) of each merged pair.
std::vector<std::pair<model::LandmarkId, model::LandmarkId>> merge_doubles(
    std::span<const model::Association> touched, const SmoothingMapperParameters& parameters,
    GlobalMap& map);

}  // namespace understory::geoslam_mapper::smoothing
