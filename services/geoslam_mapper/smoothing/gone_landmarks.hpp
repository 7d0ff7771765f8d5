// Landmarks that are taken for gone, seen again.
#pragma once

#include <span>
#include <vector>

#include "common/model/keyframe.hpp"
#include "services/geoslam_mapper/parameters.hpp"
#include "services/geoslam_mapper/smoothing/landmark_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// What of the keyframe is where a landmark stands that is not in use: each the nearest of the
/// other, of one kind, within the association gate. `known`: what is associated already. Nothing is
/// placed or fused by it; the existence tracker learns that the landmark may be there after all.
/// O(keyframe's landmarks * landmarks not in use around).
std::vector<model::Association> name_gone(const model::Keyframe& keyframe,
                                          const geometry::SE2& map_T_centre,
                                          std::span<const model::Association> known,
                                          const SmoothingMapperParameters& parameters,
                                          const LandmarkMap& landmarks);

}  // namespace understory::geoslam_mapper::smoothing
