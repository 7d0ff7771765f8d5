// The store's place on the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::submap_store {

/// Names of the channels; see the README for what each carries.
struct StoreChannels {
  // In.
  std::string submap = "SUBMAP";
  std::string submap_query = "SUBMAP_QUERY";
  std::string map_correction = "MAP_CORRECTION";
  std::string map = "MAP";
  std::string map_delta = "MAP_DELTA";
  std::string slam_update = "SLAM_UPDATE";
  std::string loop_closure = "LOOP_CLOSURE";
  std::string loop_result = "LOOP_RESULT";
  std::string existence_state = "EXISTENCE_STATE";
  // Out.
  std::string submap_stored = "SUBMAP_STORED";
  std::string submap_reply = "SUBMAP_REPLY";
  std::string map_request = "MAP_REQUEST";
};

/// The store as a service: name, channels and what makes its adapter. The adapter is a bus::Device:
/// only where it is opened does it write where the configuration says; else (replay, experiments)
/// into a temporary folder.
bus::Service submap_store_service(const StoreChannels& channels = {});

}  // namespace understory::submap_store
