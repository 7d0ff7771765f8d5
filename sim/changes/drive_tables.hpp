// A changed drive as tables of text, and back. Values are read back exactly, except for the last
// digit of a rotation.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

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

/// The texts of one drive; errors contain the `source` of each.
struct DriveTexts {
  struct Text {
    std::string text;
    std::string source;
  };
  Text poses, keypoints, segmentation, expected, points, things;
};
/// The drive from its texts. Throws io::DataError with file and line for any error: headings,
/// numbers, names, stamps without a frame, rows out of order, tables that disagree.
ChangedDrive parse_drive(const DriveTexts& texts, const CameraParameters& camera);

}  // namespace understory::sim::changes
