// A changed drive as tables of text. Each number has the digits that give it back as it was.
#pragma once

#include <span>
#include <string>

#include "sim/changes/changed_drive.hpp"

namespace understory::sim::changes {

/// Columns: utime, position and rotation (unit quaternion) of world_T_camera, for every frame.
std::string text_of_poses(std::span<const CameraFrame> frames);
/// Output of the detector, without ids.
std::string text_of_keypoints(std::span<const CameraFrame> frames);
/// Object and point of each keypoint; 0 = none.
std::string text_of_segmentation(std::span<const CameraFrame> frames);
/// The points that each frame could have shown.
std::string text_of_expected(std::span<const CameraFrame> frames);
/// Truth of all points.
std::string text_of_points(std::span<const TruePoint> points);
/// Truth of all things.
std::string text_of_things(std::span<const TrueThing> things);

}  // namespace understory::sim::changes
