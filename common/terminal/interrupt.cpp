#include "common/terminal/interrupt.hpp"

#include <csignal>

namespace understory::terminal {
namespace {

// A signal handler can access only a global variable.
std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);

}  // namespace

const std::atomic<bool>& catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = [](int /*signal*/) { interrupted = true; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  return interrupted;
}

void throw_if_interrupted() {
  if (interrupted) throw Interrupted();
}

}  // namespace understory::terminal
