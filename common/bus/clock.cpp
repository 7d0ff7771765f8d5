#include "common/bus/clock.hpp"

#include <chrono>

namespace understory::bus {

Clock system_clock() {
  using std::chrono::duration_cast;
  using std::chrono::microseconds;
  return {[] {
            const auto now = std::chrono::system_clock::now().time_since_epoch();
            return static_cast<std::int64_t>(duration_cast<microseconds>(now).count());
          },
          [] {
            const auto now = std::chrono::steady_clock::now().time_since_epoch();
            return static_cast<std::int64_t>(duration_cast<microseconds>(now).count());
          }};
}

Clock no_clock() {
  return {[] { return std::int64_t{0}; }, [] { return std::int64_t{0}; }};
}

}  // namespace understory::bus
