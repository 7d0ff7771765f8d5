// The map for output to other processes, with covariances.
#pragma once

#include <span>
#include <vector>

#include "common/model/map.hpp"
#include "services/geoslam_mapper/smoothing/common_error.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Every landmark with its marginal covariance [m^2], frame `map`, in order of id. Common errors of
/// the first keyframe's base and of all observations are included, as in the poses; landmarks of a
/// given map have the given covariance combined with later observations. Cost: about one
/// factorisation.
std::vector<model::MapLandmark> told_landmarks(const GlobalMap& map, const CommonError& common);

/// The pose of every base with its marginal covariance (right perturbation), in order of time.
/// Cost: about one factorisation.
std::vector<model::KeyframePose> told_poses(const GlobalMap& map, const CommonError& common);

/// Sets the covariances of these landmarks, which must be in the map; see told_landmarks(). Cost:
/// one elimination of the part of the graph between them and its root.
void set_covariances(std::span<model::MapLandmark> landmarks, const GlobalMap& map,
                     const CommonError& common);

}  // namespace understory::geoslam_mapper::smoothing
