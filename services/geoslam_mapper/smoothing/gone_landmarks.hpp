// New sightings of landmarks that are out of use.
#pragma once

#include <span>
#include <vector>

#include "common/model/keyframe.hpp"
#include "services/geoslam_mapper/parameters.hpp"
#include "services/geoslam_mapper/smoothing/landmark_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Pairs of keyframe landmarks and landmarks out of use at the same place: mutual nearest
/// neighbours of one kind within the association gate. `known`: the landmarks associated already.
/// The pairs are not used for localisation or fusion; they tell the existence tracker that the
/// landmark may exist after all. O(keyframe's landmarks * landmarks out of use around).
std::vector<model::Association> name_gone(const model::Keyframe& keyframe,
                                          const geometry::SE2& map_T_centre,
                                          std::span<const model::Association> known,
                                          const SmoothingMapperParameters& parameters,
                                          const LandmarkMap& landmarks);

}  // namespace understory::geoslam_mapper::smoothing
