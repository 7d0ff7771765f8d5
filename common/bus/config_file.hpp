// The bytes of a configuration file.
#pragma once

#include <filesystem>
#include <string>

namespace understory::bus {

/// All bytes of a configuration file; an empty file is a valid one. Throws ConfigurationError with
/// the path where the file is missing, is a folder, or cannot be read completely.
std::string read_config_file(const std::filesystem::path& file);

}  // namespace understory::bus
