// Processes that live as long as an object.
#pragma once

#include <chrono>
#include <csignal>
#include <thread>
#include <vector>

#include "deploy/launch/child_process.hpp"

namespace understory::eval::experiments::reliability {

/// Processes that end when this goes. They are asked to: `understory launch` that is killed leaves
/// the processes that it started, for the next launch to adopt. Only what does not end is killed.
class Processes {
 public:
  using Clock = std::chrono::steady_clock;

  /// Longer than a launch takes at most: it ends its processes in two groups.
  explicit Processes(std::chrono::milliseconds patience = std::chrono::seconds(20))
      : patience_(patience) {}
  ~Processes() {
    ask_to_end();
    // A process that a fault has stopped takes no SIGTERM before it goes on.
    for (const auto& child : children_) child.signal(SIGCONT);
    const auto last = Clock::now() + patience_;
    bool is_killed = false;
    for (const auto& child : children_) {
      while (!child.ended()) {
        if (!is_killed && Clock::now() > last) {
          for (const auto& late : children_) late.signal(SIGKILL);
          is_killed = true;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    }
  }
  Processes(const Processes&) = delete;
  Processes& operator=(const Processes&) = delete;

  /// Throws std::system_error when it cannot be executed.
  void start(const launch::Command& command) {
    children_.push_back(launch::ChildProcess::start(command));
  }
  void ask_to_end() const {
    for (const auto& child : children_) child.signal(SIGTERM);
  }

 private:
  std::chrono::milliseconds patience_;
  std::vector<launch::ChildProcess> children_;
};

}  // namespace understory::eval::experiments::reliability
