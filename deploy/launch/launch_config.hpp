// launch.toml: which processes a machine runs.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace understory::launch {

/// One [[process]] of the file.
struct ProcessEntry {
  std::string name;                    ///< As in its HEALTH messages: letters, digits, _ and -.
  std::string executable;              ///< Beside the understory command, in PATH, or a path.
  std::filesystem::path config;        ///< Beside launch.toml unless absolute; empty = none.
  std::vector<std::string> arguments;  ///< Further ones, unchanged.
  bool keeps_state = true;             ///< Whether it is given --state-dir.
};

/// The content of launch.toml.
struct LaunchConfig {
  std::vector<ProcessEntry> processes;  ///< In the order of the file: the order of starting.
};

/// what() is one line: file, line, key, what is wrong and what is allowed.
class ConfigError : public std::runtime_error {
 public:
  /// From the one-line message that what() gives.
  using std::runtime_error::runtime_error;
};

/// Reads DIR/launch.toml. Throws ConfigError.
LaunchConfig read_launch_config(const std::filesystem::path& directory);

}  // namespace understory::launch
