// A frame for place recognition: landmarks and, optionally, a cloud of points.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/place_recognition/level_stems.hpp"

namespace understory::place_recognition {

/// Id of a frame, assigned by the caller; increases from frame to frame.
using FrameId = std::int64_t;

/// A landmark of a frame, frame `vehicle_level`.
struct PlaceLandmark {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< z = 0 where unknown.
  double diameter_m = 0.0;                               ///< 0 where unknown.
};

/// Input of a detector or a verifier: a keyframe, or a whole submap in the frame of its origin.
/// Coordinates are in `vehicle_level` [m]. Readers skip values that are not finite or beyond
/// kMostDistantM.
struct PlaceFrame {
  FrameId id = 0;
  std::vector<PlaceLandmark> landmarks;
  /// Levelled, down-sampled; empty if only landmarks are known.
  std::vector<Eigen::Vector3f> cloud;
};

/// Largest coordinate of a frame's content, on any axis.
inline constexpr double kMostDistantM = 1000.0;

/// The valid landmarks, in the order of the frame.
std::vector<PlaceLandmark> landmarks_of(const PlaceFrame& frame);

/// The same in the plane.
std::vector<LevelStem> level_stems(const PlaceFrame& frame);

/// The valid points of the cloud; for a frame without a cloud, the landmarks as points.
std::vector<Eigen::Vector3f> points_of(const PlaceFrame& frame);

}  // namespace understory::place_recognition
