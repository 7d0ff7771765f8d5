// The viewer on the bus, and its web server.
#pragma once

#include "common/bus/service.hpp"

namespace understory::viewer {

/// The process: it hears every channel that it shows (scene_channels.hpp) and publishes none.
bus::Service viewer_service();

}  // namespace understory::viewer
