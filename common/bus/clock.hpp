// The computer's clocks; the runtime uses them for HEALTH only.
#pragma once

#include <cstdint>
#include <functional>

namespace understory::bus {

/// Functions, so that tests and replay can replace them.
struct Clock {
  std::function<std::int64_t()> wall_us;       ///< Since 1970 [us].
  std::function<std::int64_t()> monotonic_us;  ///< Never goes back [us].
};

/// The computer's own clocks.
Clock system_clock();
/// Always zero: a replay must not depend on a clock.
Clock no_clock();

}  // namespace understory::bus
