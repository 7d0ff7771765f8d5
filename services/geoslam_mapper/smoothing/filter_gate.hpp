// Whether the filter's motion contradicts a placement.
#pragma once

#include "common/model/keyframe.hpp"
#include "services/geoslam_mapper/smoothing/filter_track.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/placement.hpp"

namespace understory::geoslam_mapper::smoothing {

/// True where a keyframe with at most two associations moved by more than `limit_m` otherwise than
/// the filter: within itself, or since the last accepted keyframe if that is at most 3 s old. A
/// pedestrian taken for the only trunk in view would otherwise drag the map along. Always false
/// with a limit of 0.
bool contradicts_filter(const model::Keyframe& keyframe, const Placement& placement,
                        const FilterTrack& filter, const GlobalMap& map, double limit_m);

}  // namespace understory::geoslam_mapper::smoothing
