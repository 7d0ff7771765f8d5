// The supervisor's note of what it runs, kept in the state directory: one supervisor at a time, and
// the next one takes over what a killed one left running.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "deploy/launch/supervisor.hpp"

namespace understory::launch {

/// The note and the lock on its directory. Where the directory cannot be written (a read-only, full
/// or failing disk), both are in a directory of this user's in the system's temporary one; where
/// that cannot be written either, there are none: a vehicle drives all the same.
class Registry {
 public:
  /// Takes the lock on the directory (which is made where missing). Throws std::runtime_error
  /// naming the directory when another supervisor holds it.
  explicit Registry(const std::filesystem::path& state_directory);
  ~Registry();
  Registry(const Registry&) = delete;
  Registry& operator=(const Registry&) = delete;

  /// Why the state directory cannot be written: its name and the system's words; empty where it
  /// can.
  const std::string& trouble() const { return trouble_; }
  /// The latest note; empty where there is none or it cannot be read.
  std::vector<ProcessStatus> read() const;
  /// Replaces the note in one step. Errors are ignored: a vehicle drives on with a full disk.
  void write(const std::vector<ProcessStatus>& processes) const;

 private:
  std::filesystem::path note_;
  std::filesystem::path spare_note_;  ///< Newer than the other one where it exists.
  std::string trouble_;
  int lock_ = -1;
};

}  // namespace understory::launch
