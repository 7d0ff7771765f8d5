// Ctrl-C as a flag that long calls look at.
#pragma once

#include <atomic>

namespace understory::eval {

/// From now on SIGINT and SIGTERM set the flag instead of ending the process; a second one ends it.
const std::atomic<bool>& stop_on_interrupt();

}  // namespace understory::eval
