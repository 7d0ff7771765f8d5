// Connects the loop closer to the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::loop_closer {

/// The channels, declared once: `--help` and the diagram of services/README.md follow.
struct LoopCloserChannels {
  bus::ChannelList all;
  std::string keyframe = all.in("KEYFRAME", "local landmarks, to recognise places");
  std::string place_scan = all.in("PLACE_SCAN", "clouds, for detectors that compare clouds");
  std::string slam_update = all.in("SLAM_UPDATE", "pose of each keyframe in the map");
  std::string submap = all.in("SUBMAP", "keyframes that the mapper gave to the store");
  std::string loop_result =
      all.in("LOOP_RESULT", "whether a closure was accepted or refused, and why");
  std::string loop_closure = all.out("LOOP_CLOSURE", "two places and their relative pose");
};

/// The service: its name, its channels and the factory of its adapter. The stage is made when the
/// service is bound, with the parameters of that time.
bus::Service loop_closer_service(const LoopCloserChannels& channels = {});

}  // namespace understory::loop_closer
