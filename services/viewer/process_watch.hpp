// State of the processes on the bus, from the operating system.
#pragma once

#include <cstdint>

#include "services/viewer/process_board.hpp"

namespace understory::viewer {

/// Reads the state of one process of this computer. An unknown process is reported as not running:
/// the caller must exclude processes of other computers.
ProcessSample look_at_process(std::int64_t pid);

}  // namespace understory::viewer
