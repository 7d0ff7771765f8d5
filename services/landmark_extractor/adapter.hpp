// The landmark extractor's place on the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::landmark_extractor {

struct LandmarkExtractorChannels {
  std::string lidar_scan = "LIDAR_SCAN";
  std::string lidar_sweep = "LIDAR_SWEEP";
  std::string landmarks = "LANDMARKS";
};

bus::Service landmark_extractor_service(const LandmarkExtractorChannels& channels = {});

}  // namespace understory::landmark_extractor
