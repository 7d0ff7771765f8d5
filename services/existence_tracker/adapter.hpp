// The existence tracker on the bus.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::existence_tracker {

/// The channels, declared once: `--help` and the diagram of services/README.md follow.
struct TrackerChannels {
  bus::ChannelList all;
  std::string slam_update =
      all.in("SLAM_UPDATE", "landmarks seen, and landmarks expected and not seen");
  std::string map = all.in("MAP", "positions of all landmarks");
  std::string map_delta = all.in("MAP_DELTA", "changes of the map");
  std::string existence = all.out("EXISTENCE", "probability that each landmark exists");
  std::string existence_state =
      all.out("EXISTENCE_STATE", "state of each landmark, for the next drive");
  std::string map_request = all.out("MAP_REQUEST", "asks for MAP where landmarks are not known");
};

/// The process: its name, its channels and how to make its adapter. The stage is made when the
/// service is bound, by the parameters that are then in force.
bus::Service existence_tracker_service(const TrackerChannels& channels = {});

}  // namespace understory::existence_tracker
