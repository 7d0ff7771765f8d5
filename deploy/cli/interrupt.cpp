#include "deploy/cli/interrupt.hpp"

#include <csignal>

namespace understory {
namespace {

volatile std::sig_atomic_t interrupted = 0;  // A handler can reach nothing else.

}  // namespace

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = [](int /*signal*/) { interrupted = 1; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

void throw_if_interrupted() {
  if (interrupted != 0) throw Interrupted();
}

}  // namespace understory
