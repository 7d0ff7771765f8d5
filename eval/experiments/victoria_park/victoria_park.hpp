// A real drive: from the recorded laser and wheels of the Victoria Park car to a map.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/io/victoria_park.hpp"
#include "common/model/map.hpp"
#include "common/model/odometry.hpp"
#include "eval/metrics/victoria_park_score.hpp"
#include "services/geoslam_mapper/parameters.hpp"
#include "services/keyframer/parameters.hpp"
#include "services/landmark_extractor/parameters.hpp"

namespace understory::eval::experiments::victoria_park {

/// Parameters of the three stages, and how much of the recording is used.
struct VictoriaParkConfig {
  landmark_extractor::LandmarkExtractorParameters extractor;
  keyframer::JointKeyframerParameters keyframer;
  geoslam_mapper::SmoothingMapperParameters mapper;
};

/// Joint keyframes, the smoothing mapper, dead reckoning between keyframes.
VictoriaParkConfig victoria_park_defaults();

/// Wall time of one stage, per scan [s].
struct StageTimes {
  std::vector<double> extractor_s;
  std::vector<double> keyframer_s;
  std::vector<double> mapper_s;  ///< Zero for a scan that completed no keyframe.
};

/// What the stages gave on the recording.
struct VictoriaParkRun {
  std::vector<model::Odometry> odometry;            ///< Between consecutive scans.
  std::vector<metrics::StampedPose> dead_reckoned;  ///< Of every scan, from the first one's pose.
  std::vector<metrics::StampedPose> live;           ///< Of keyframes, as they were published.
  std::vector<metrics::StampedPose> trajectory;     ///< Of every scan, as estimated at the end.
  std::vector<model::MapUpdate> updates;
  std::vector<model::MapLandmark> landmarks;
  StageTimes times;
  std::uint64_t detections = 0;
  std::uint64_t keyframes_withheld = 0;
  std::string last_withheld_reason;
};

/// Relative motion of the car between consecutive scans.
std::vector<model::Odometry> victoria_park_odometry(const io::VictoriaPark& recording);

/// Drives through the recording; `progress` is called after each scan.
VictoriaParkRun drive_victoria_park(const io::VictoriaPark& recording,
                                    const VictoriaParkConfig& config,
                                    const std::function<void()>& progress);

}  // namespace understory::eval::experiments::victoria_park
