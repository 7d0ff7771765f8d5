// Connects the store to the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::submap_store {

/// The channels, declared once: `--help` and the diagram of services/README.md follow.
struct StoreChannels {
  bus::ChannelList all;
  std::string submap = all.in("SUBMAP", "a submap to keep");
  std::string submap_query = all.in("SUBMAP_QUERY", "request for submaps");
  std::string map_correction = all.in("MAP_CORRECTION", "poses of the submaps");
  std::string map = all.in("MAP", "the part of the map that the mapper keeps itself");
  std::string map_delta = all.in("MAP_DELTA", "changes of MAP");
  std::string slam_update = all.in("SLAM_UPDATE", "keyframes of the mapper");
  std::string loop_closure = all.in("LOOP_CLOSURE", "two places and their relative pose");
  std::string loop_result =
      all.in("LOOP_RESULT", "whether a closure was accepted or refused, and why");
  std::string existence_state =
      all.in("EXISTENCE_STATE", "state of each landmark, for the next drive");
  std::string submap_stored = all.out("SUBMAP_STORED", "a submap is on disk");
  std::string submap_reply = all.out("SUBMAP_REPLY", "a submap requested by SUBMAP_QUERY");
  std::string map_request = all.out("MAP_REQUEST", "request for MAP if changes were missed");
};

/// The store as a service: its name, its channels and the factory of its adapter. The adapter is a
/// bus::Device: only after open() does it write to the configured folder; else (replay,
/// experiments) to a temporary folder.
bus::Service submap_store_service(const StoreChannels& channels = {});

}  // namespace understory::submap_store
