// Ctrl-C and SIGTERM as an ordinary failure, so that destructors tidy up what is half written.
#pragma once

#include <atomic>
#include <stdexcept>

namespace understory::terminal {

/// Somebody ended the call before its work was done.
class Interrupted : public std::runtime_error {
 public:
  /// what() is "interrupted".
  Interrupted() : std::runtime_error("interrupted") {}
};

/// From now on SIGINT and SIGTERM only set the flag that is returned; a second one ends the process
/// at once. May be called again.
const std::atomic<bool>& catch_interrupts();
/// Throws Interrupted once the flag is set; to be called in every long loop.
void throw_if_interrupted();

}  // namespace understory::terminal
