// Landmarks that are detected scan after scan.
#pragma once

#include <cstdint>
#include <vector>

#include "common/model/landmarks.hpp"

namespace understory::model {

/// Id of a track; never used again by another one; 0 = none.
using TrackId = std::uint64_t;

/// A detection with the track of its landmark.
struct TrackedLandmark {
  TrackId track_id = 0;
  std::uint32_t detection = 0;  ///< Index in the LANDMARKS message of the same utime.
  Detection observed;           ///< That detection; its covariance as learned (decision 045).
};

/// Channel TRACKED_LANDMARKS: the consistent ones among the detections of one sweep.
struct TrackedScan {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  FieldOfView field_of_view;
  std::vector<TrackedLandmark> landmarks;
};

}  // namespace understory::model
