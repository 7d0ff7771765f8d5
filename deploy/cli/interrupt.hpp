// Ctrl-C and SIGTERM as an ordinary failure, so that destructors tidy up what is half written.
#pragma once

#include <stdexcept>

namespace understory {

class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("interrupted") {}
};

/// From now on Ctrl-C and SIGTERM only set a flag; a second one ends the process at once.
void catch_interrupts();
/// Throws Interrupted once the flag is set; to be called in every long loop.
void throw_if_interrupted();

}  // namespace understory
