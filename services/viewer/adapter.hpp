// The viewer on the bus, and its web server.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::viewer {

/// Name of the channel that it writes; those that it hears are in scene_channels.hpp.
struct ViewerChannels {
  std::string map_request = "MAP_REQUEST";
};

/// The process. In a replay it hears nothing and says nothing.
bus::Service viewer_service(const ViewerChannels& channels = {});

}  // namespace understory::viewer
