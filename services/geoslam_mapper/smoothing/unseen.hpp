// Expected landmarks that a keyframe did not detect.
#pragma once

#include <span>
#include <vector>

#include "common/model/keyframe.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Most landmarks reported for one keyframe: no scene has more in view.
inline constexpr std::size_t kMostExpected = 1000;

/// Landmarks in the field of view of every scan of the keyframe without an association, in order of
/// id; beyond the limit the nearest. Landmarks out of use are included. Landmarks with an ambiguous
/// association are not: a detection may be one of them. Occlusion is not considered here.
/// `map_T_centre`: pose of the keyframe. O(landmarks in range).
std::vector<model::ExpectedLandmark> expected_unseen(
    const model::Keyframe& keyframe, const geometry::SE2& map_T_centre,
    std::span<const model::Association> associations, const LandmarkMap& landmarks);

/// Removes landmarks that only the first keyframe observed although all later keyframes had them in
/// view; returns their ids, ascending. Call it after the first few keyframes, with the graph
/// solved; the poses do not change, since no other factor involves these landmarks. O(landmarks *
/// keyframes).
std::vector<model::LandmarkId> drop_unseen(const model::FieldOfView& view, GlobalMap& map);

}  // namespace understory::geoslam_mapper::smoothing
