// launch.toml: the processes of a machine and the files of their parameters.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace understory::bus {

/// One [[process]] of the file.
struct ProcessEntry {
  std::string name;                    ///< As in its HEALTH messages: letters, digits, _ and -.
  std::string executable;              ///< Beside the understory command, in PATH, or a path.
  std::filesystem::path config;        ///< Beside launch.toml unless absolute; empty = none.
  std::vector<std::string> arguments;  ///< Further arguments, unchanged.
  bool is_service = true;   ///< False: another program, without HEALTH, state or place in a replay.
  bool keeps_state = true;  ///< Whether it gets --state-dir.
  bool ends_last = false;   ///< Stopped after all others: it records their last messages.
};

/// The content of launch.toml.
struct LaunchConfig {
  std::vector<ProcessEntry> processes;  ///< In the order of the file: the order of starting.
};

/// Reads DIR/launch.toml: its own processes, and those of the folder that its key `base` names.
/// Files in DIR replace files of the same name in that folder; such a file must state a `base` of
/// its own (which may be empty), or the base's values would be lost without notice. Throws
/// ConfigurationError.
LaunchConfig read_launch_config(const std::filesystem::path& directory);

/// The parameter file of a process in a configuration folder: as in its launch.toml, or NAME.toml
/// where launch.toml or the process is missing; empty (defaults) where NAME.toml is missing. Throws
/// ConfigurationError for a wrong launch.toml.
std::filesystem::path config_file_in(const std::filesystem::path& directory,
                                     const std::string& process);

}  // namespace understory::bus
