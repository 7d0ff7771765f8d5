// The supervisor's note of its running processes, in the state directory. It admits one supervisor
// at a time; the next one takes over processes of a killed one.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "deploy/launch/supervisor.hpp"

namespace understory::launch {

/// The note and the lock on its directory. Where the directory cannot be written (a read-only, full
/// or failing disk), both are in a directory of this user's in the system's temporary one; if that
/// cannot be written either, there are none, and the vehicle still runs.
class Registry {
 public:
  /// Takes the lock on the directory (which is made where missing). Throws std::runtime_error with
  /// the directory where another supervisor has the lock.
  explicit Registry(const std::filesystem::path& state_directory);
  ~Registry();
  Registry(const Registry&) = delete;
  Registry& operator=(const Registry&) = delete;

  /// The reason why the state directory cannot be written: its name and the system's message; empty
  /// = writable.
  const std::string& trouble() const { return trouble_; }
  /// The latest note; empty = none, or unreadable.
  std::vector<ProcessStatus> read() const;
  /// Replaces the note in one step. Errors are ignored, so that a vehicle continues with a full
  /// disk.
  void write(const std::vector<ProcessStatus>& processes) const;

 private:
  std::filesystem::path note_;
  std::filesystem::path spare_note_;  ///< Newer than the other note if it exists.
  std::string trouble_;
  int lock_ = -1;
};

}  // namespace understory::launch
