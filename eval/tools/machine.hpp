// On what and by which version a figure was made.
#pragma once

#include <string>

namespace understory::eval::tools {

struct Machine {
  std::string cpu;
  unsigned cores = 0;
};
Machine this_machine();

/// `git describe` of the source at the time of the build; the release's number outside a checkout.
std::string version();

}  // namespace understory::eval::tools
