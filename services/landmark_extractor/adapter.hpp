// Connects the landmark extractor to the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::landmark_extractor {

/// The channels, declared once: `--help` and the diagram of services/README.md follow.
struct LandmarkExtractorChannels {
  bus::ChannelList all;
  std::string lidar_scan = all.in("LIDAR_SCAN", "scans of a one-plane laser");
  std::string lidar_sweep = all.in("LIDAR_SWEEP", "sweeps of a laser with many rings, in parts");
  std::string landmarks = all.out("LANDMARKS", "trunks and corners of each sweep");
  std::string view_ranges =
      all.out("VIEW_RANGES", "free range of each sweep at the height of trunks, by bearing");
  std::string place_scan = all.out("PLACE_SCAN", "clouds for loop detectors that compare clouds");
};

/// The service, for run_service() and replay.
bus::Service landmark_extractor_service(const LandmarkExtractorChannels& channels = {});

}  // namespace understory::landmark_extractor
