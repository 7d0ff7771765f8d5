// The loop closer on the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::loop_closer {

/// Names of the channels that the process reads and writes.
struct LoopCloserChannels {
  std::string keyframe = "KEYFRAME";
  std::string place_scan = "PLACE_SCAN";
  std::string slam_update = "SLAM_UPDATE";
  std::string submap = "SUBMAP";
  std::string loop_result = "LOOP_RESULT";
  std::string loop_closure = "LOOP_CLOSURE";
};

/// The process: its name, its channels and how to make its adapter. The stage is made when the
/// service is bound, by the parameters that are then in force.
bus::Service loop_closer_service(const LoopCloserChannels& channels = {});

}  // namespace understory::loop_closer
