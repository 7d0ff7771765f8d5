// The supervisor's note of what it runs, kept in the state directory: one supervisor at a time, and
// the next one takes over what a killed one left running.
#pragma once

#include <filesystem>
#include <vector>

#include "deploy/launch/supervisor.hpp"

namespace understory::launch {

/// The note and the lock on its directory.
class Registry {
 public:
  /// Takes the lock on the directory (which is made where missing). Throws std::runtime_error
  /// naming the directory when another supervisor holds it.
  explicit Registry(const std::filesystem::path& state_directory);
  ~Registry();
  Registry(const Registry&) = delete;
  Registry& operator=(const Registry&) = delete;

  /// The latest note; empty where there is none or it cannot be read.
  std::vector<ProcessStatus> read() const;
  /// Replaces the note in one step. Errors are ignored: a vehicle drives on with a full disk.
  void write(const std::vector<ProcessStatus>& processes) const;

 private:
  std::filesystem::path note_;
  int lock_ = -1;
};

}  // namespace understory::launch
