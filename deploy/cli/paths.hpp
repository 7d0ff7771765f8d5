// Paths of the command's programs, configuration and state.
#pragma once

#include <filesystem>
#include <string>

namespace understory::cli {

/// The directory of this executable, which also has the processes, built or installed.
std::filesystem::path executable_directory();
/// `name` beside this executable if it exists; else `name` unchanged, for PATH.
std::string find_executable(const std::string& name);
/// UNDERSTORY_CONFIG, else the installed configuration, else that of the working tree.
std::filesystem::path default_config_directory();
/// UNDERSTORY_STATE, else the user's state directory (XDG), else one below the home directory.
std::filesystem::path default_state_directory();

}  // namespace understory::cli
