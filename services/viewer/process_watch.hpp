// What the operating system knows of the processes on the bus.
#pragma once

#include <cstdint>

#include "services/viewer/process_board.hpp"

namespace understory::viewer {

/// Looks at one process of this computer. Where the computer does not know it, it does not run: a
/// process of another computer has to be told apart by the caller.
ProcessSample look_at_process(std::int64_t pid);

}  // namespace understory::viewer
