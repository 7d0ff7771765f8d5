// One moment as place recognition sees it: landmarks and, where there is one, a cloud of points.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/place_recognition/level_stems.hpp"

namespace understory::place_recognition {

/// Name of a frame, given by the caller; grows from frame to frame.
using FrameId = std::int64_t;

/// A landmark of a frame, frame `vehicle_level`.
struct PlaceLandmark {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< z = 0 where it is not known.
  double diameter_m = 0.0;                               ///< 0 where it is not known.
};

/// What a detector or a verifier may look at: a keyframe, or a whole submap in the frame of its
/// origin. Every coordinate is in `vehicle_level` [m]. What is not finite or farther than
/// kMostDistantM is left out by who reads it.
struct PlaceFrame {
  FrameId id = 0;
  std::vector<PlaceLandmark> landmarks;
  /// Levelled, down-sampled; empty where only landmarks are known.
  std::vector<Eigen::Vector3f> cloud;
};

/// Nothing that belongs to a frame is farther away, on any axis.
inline constexpr double kMostDistantM = 1000.0;

/// The landmarks that count, in the order of the frame.
std::vector<PlaceLandmark> landmarks_of(const PlaceFrame& frame);

/// The same in the plane.
std::vector<LevelStem> level_stems(const PlaceFrame& frame);

/// The points of the cloud that count; of a frame without a cloud, the landmarks as points.
std::vector<Eigen::Vector3f> points_of(const PlaceFrame& frame);

}  // namespace understory::place_recognition
