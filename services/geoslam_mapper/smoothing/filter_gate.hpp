// Tests a placement against the filter's motion.
#pragma once

#include "common/model/keyframe.hpp"
#include "services/geoslam_mapper/smoothing/filter_track.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/placement.hpp"

namespace understory::geoslam_mapper::smoothing {

/// True if the motion of a keyframe with at most two associations differs from the filter's by more
/// than `limit_m`: within the keyframe, or since the last accepted keyframe if that is at most 3 s
/// old. Without it a pedestrian, associated with the only trunk in view, would drag the map along.
/// Always false with a limit of 0.
bool contradicts_filter(const model::Keyframe& keyframe, const Placement& placement,
                        const FilterTrack& filter, const GlobalMap& map, double limit_m);

}  // namespace understory::geoslam_mapper::smoothing
