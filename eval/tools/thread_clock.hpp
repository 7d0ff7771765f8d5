// Processor time of the calling thread.
#pragma once

#include <ctime>

namespace understory::eval::tools {

/// Processor time of this thread [s]; other work of the machine does not count.
inline double thread_time_s() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace understory::eval::tools
