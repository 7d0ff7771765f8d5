// What should have been seen and was not.
#pragma once

#include <span>
#include <vector>

#include "common/model/keyframe.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Most landmarks that are named for one keyframe: no scene has more in view.
inline constexpr std::size_t kMostExpected = 1000;

/// Landmarks in the field of view of every scan of the keyframe with none of the `associations`, in
/// order of id; of too many the nearest. Those that are not in use are among them. Without those
/// that are loose: what was seen may be one of them. Of lines of sight nothing is known here.
/// `map_T_centre`: where the keyframe is. O(landmarks in range).
std::vector<model::ExpectedLandmark> expected_unseen(
    const model::Keyframe& keyframe, const geometry::SE2& map_T_centre,
    std::span<const model::Association> associations, const LandmarkMap& landmarks);

/// Takes those landmarks out that the first keyframe alone observed though all keyframes after it
/// had them in view, and returns their ids, ascending. To be called after the first few keyframes,
/// the graph being solved; the poses stay as they are, as nothing else hangs on these landmarks.
/// O(landmarks * keyframes).
std::vector<model::LandmarkId> drop_unseen(const model::FieldOfView& view, GlobalMap& map);

}  // namespace understory::geoslam_mapper::smoothing
