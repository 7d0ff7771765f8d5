// Ctrl-C and SIGTERM as an ordinary failure, so that destructors remove incomplete files.
#pragma once

#include <atomic>
#include <stdexcept>

namespace understory::terminal {

/// The user ended the call before its work was done.
class Interrupted : public std::runtime_error {
 public:
  /// what() is "interrupted".
  Interrupted() : std::runtime_error("interrupted") {}
};

/// From now on SIGINT and SIGTERM only set the returned flag; a second one ends the process at
/// once. May be called again.
const std::atomic<bool>& catch_interrupts();
/// Throws Interrupted if the flag is set; call it in every long loop.
void throw_if_interrupted();

}  // namespace understory::terminal
