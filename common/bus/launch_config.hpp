// launch.toml: which processes a machine runs, and where their parameters are.
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
  std::vector<std::string> arguments;  ///< Further ones, unchanged.
  bool is_service = true;   ///< False: another program, without HEALTH, state or place in a replay.
  bool keeps_state = true;  ///< Whether it is given --state-dir.
  bool ends_last = false;   ///< Asked to end when all others have: it keeps their last words.
};

/// The content of launch.toml.
struct LaunchConfig {
  std::vector<ProcessEntry> processes;  ///< In the order of the file: the order of starting.
};

/// Reads DIR/launch.toml: the processes of the folder that its key `base` names, whose files give
/// way to files of the same name in DIR, and its own. A file in DIR that stands for one of the base
/// must state a `base` of its own (which may be empty), or the base's values would be lost in
/// silence. Throws ConfigurationError.
LaunchConfig read_launch_config(const std::filesystem::path& directory);

/// The file of a process's parameters in a configuration folder: as its launch.toml says, or
/// NAME.toml where it has no such file or process; empty where that is not there: defaults. Throws
/// ConfigurationError for a wrong launch.toml.
std::filesystem::path config_file_in(const std::filesystem::path& directory,
                                     const std::string& process);

}  // namespace understory::bus
