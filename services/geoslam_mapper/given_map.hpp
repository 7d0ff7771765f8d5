// A map to begin with: from a file or from a message.
#pragma once

#include <string>
#include <vector>

#include "common/model/map.hpp"
#include "common/model/slam_output.hpp"

namespace understory::geoslam_mapper {

/// One map of a map file, its landmarks in order of id. `map_id` 0: the only one in the file
/// that has landmarks. Throws map_file::MapFileError, or std::runtime_error that names the file
/// where that map is not in it or has no landmark.
model::WholeMap read_given_map(const std::string& file, int map_id);

/// Why a message's map cannot be begun with; empty where it can: it is whole, has landmarks, and
/// all of them are finite and in order of id.
std::string why_not_given(const model::WholeMap& map);

/// The map's landmarks with the covariance that each has beside the keyframe nearest to it, at
/// least `least_sigma_m`. A map that was driven states covariances relative to its first keyframe;
/// far from there they are large, and nearly all of it neighbours share. Taken for an error of each
/// landmark it would hide which of them a detection is. Landmarks of a map without keyframes (a
/// survey), and those that are stated to be better than `least_sigma_m`, stay as they are.
/// Keyframes with values that cannot be are passed over. Cost: each landmark looks around it.
std::vector<model::MapLandmark> apart_from_keyframes(const model::WholeMap& map,
                                                     double least_sigma_m);

}  // namespace understory::geoslam_mapper
