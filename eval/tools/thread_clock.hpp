// How long the calling thread has computed.
#pragma once

#include <ctime>

namespace understory::eval::tools {

/// Processor time of this thread [s]: what else the machine does is left out.
inline double thread_time_s() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace understory::eval::tools
