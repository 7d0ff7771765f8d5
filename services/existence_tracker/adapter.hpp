// Connects the existence tracker to the bus.
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
  std::string map_request = all.out("MAP_REQUEST", "request for MAP if landmarks are not known");
};

/// The service: its name, its channels and the factory of its adapter. The stage is made when the
/// service is bound, with the parameters of that time.
bus::Service existence_tracker_service(const TrackerChannels& channels = {});

}  // namespace understory::existence_tracker
