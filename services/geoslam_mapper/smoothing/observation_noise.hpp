// Weight of an observation whose error is correlated with earlier ones.
#pragma once

#include "common/model/keyframe.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Adds the observation of a landmark from a node to the graph, weighted by its correlation with
/// earlier ones: a share of an observation's variance stays the same while the viewpoint does (a
/// trunk is no cylinder). That correlated error is modelled as white noise of the same power. While
/// the vehicle is stationary, a second observation from the same node adds nothing. The landmark
/// must be in the graph; `observed` is in the node's frame.
void observe(const model::KeyframeLandmark& observed, NodeIndex node, model::LandmarkId id,
             const SmoothingMapperParameters& parameters, GlobalMap& map);

}  // namespace understory::geoslam_mapper::smoothing
