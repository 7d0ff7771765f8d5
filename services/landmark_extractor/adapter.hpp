// The landmark extractor on the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::landmark_extractor {

/// Names of its channels; every one can be replaced.
struct LandmarkExtractorChannels {
  std::string lidar_scan = "LIDAR_SCAN";
  std::string lidar_sweep = "LIDAR_SWEEP";
  std::string landmarks = "LANDMARKS";
  std::string view_ranges = "VIEW_RANGES";
  std::string place_scan = "PLACE_SCAN";
};

/// The service, for run_service() and replay.
bus::Service landmark_extractor_service(const LandmarkExtractorChannels& channels = {});

}  // namespace understory::landmark_extractor
