// Landmarks tracked over scans.
#pragma once

#include <cstdint>
#include <vector>

#include "common/model/landmarks.hpp"

namespace understory::model {

/// Id of a track; never reused; 0 = none.
using TrackId = std::uint64_t;

/// A detection with the track of its landmark.
struct TrackedLandmark {
  TrackId track_id = 0;
  std::uint32_t detection = 0;  ///< Index in the LANDMARKS message of the same utime.
  Detection observed;           ///< The detection with its learned covariance (decision 045).
};

/// Channel TRACKED_LANDMARKS: the consistent detections of one sweep.
struct TrackedScan {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  FieldOfView field_of_view;
  std::vector<TrackedLandmark> landmarks;
};

}  // namespace understory::model
