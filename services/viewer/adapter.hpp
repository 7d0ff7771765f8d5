// Connects the viewer to the bus, and its web server.
#pragma once

#include <string>

#include "common/bus/service.hpp"

namespace understory::viewer {

/// The channels of scene_channels.hpp as inputs, and a web page.
bus::ChannelList shown_channels();

/// The channels, declared once: `--help` and the diagram of services/README.md follow.
struct ViewerChannels {
  bus::ChannelList all = shown_channels();
  std::string map_request = all.out("MAP_REQUEST", "request for MAP if the viewer started late");
};

/// The service. In a replay it receives and publishes nothing.
bus::Service viewer_service(const ViewerChannels& channels = {});

}  // namespace understory::viewer
