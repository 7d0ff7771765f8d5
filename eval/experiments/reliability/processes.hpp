// Processes that live as long as an object.
#pragma once

#include <chrono>
#include <csignal>
#include <thread>
#include <vector>

#include "deploy/launch/child_process.hpp"

namespace understory::eval::experiments::reliability {

/// Processes that are killed when this goes.
class Processes {
 public:
  Processes() = default;
  ~Processes() {
    for (const auto& child : children_) child.signal(SIGCONT);
    for (const auto& child : children_) child.signal(SIGKILL);
    for (const auto& child : children_) {
      while (!child.ended()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
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
  std::vector<launch::ChildProcess> children_;
};

}  // namespace understory::eval::experiments::reliability
