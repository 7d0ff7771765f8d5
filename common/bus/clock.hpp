// The computer's clocks, as far as the runtime may look at them: for HEALTH only.
#pragma once

#include <cstdint>
#include <functional>

namespace understory::bus {

/// Functions, so that tests and replay bring their own.
struct Clock {
  std::function<std::int64_t()> wall_us;       ///< Since 1970 [us].
  std::function<std::int64_t()> monotonic_us;  ///< Never goes back [us].
};

/// The computer's own.
Clock system_clock();
/// Always zero: in replay nothing may depend on a clock.
Clock no_clock();

}  // namespace understory::bus
