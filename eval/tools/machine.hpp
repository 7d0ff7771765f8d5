// On what machine, when and by which version a figure was made.
#pragma once

#include <string>

namespace understory::eval::tools {

/// The computer of a measurement.
struct Machine {
  std::string cpu;     ///< Model name as /proc/cpuinfo states it; "unknown" where it does not.
  unsigned cores = 0;  ///< Hardware threads.
};

/// The computer that runs this process.
Machine this_machine();

/// Today's date in UTC as YYYY-MM-DD.
std::string today();

/// `git describe` of the tree at the time of the build, with "-dirty" where anything but stored
/// results was changed; the release's number outside a checkout.
std::string version();

}  // namespace understory::eval::tools
