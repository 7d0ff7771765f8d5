// The existence tracker on the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::existence_tracker {

/// Names of the channels that the process reads and writes.
struct TrackerChannels {
  std::string slam_update = "SLAM_UPDATE";
  std::string map = "MAP";
  std::string map_delta = "MAP_DELTA";
  std::string existence = "EXISTENCE";
  std::string existence_state = "EXISTENCE_STATE";
  std::string map_request = "MAP_REQUEST";
};

/// The process: its name, its channels and how to make its adapter. The stage is made when the
/// service is bound, by the parameters that are then in force.
bus::Service existence_tracker_service(const TrackerChannels& channels = {});

}  // namespace understory::existence_tracker
