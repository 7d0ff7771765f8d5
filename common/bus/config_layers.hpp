// A configuration file and those that it builds on, by its key `base`.
#pragma once

#include <toml++/toml.h>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace understory::bus {

/// The key that names the file (or, in launch.toml, the folder) that another builds on.
inline constexpr std::string_view kBaseKey = "base";

/// One file: what it states alone.
struct ConfigLayer {
  std::string name;  ///< As in messages: the path as it was reached.
  toml::table table;
};

/// "leads back: a -> b -> a" where `next` is one of the files that led to it; else empty.
std::string cycle_in(const std::vector<std::filesystem::path>& files,
                     const std::filesystem::path& next);

/// The path that the key `base` of a file names, relative to the file's folder; none where it has
/// no such key, or an empty one. Throws ConfigurationError with file, line and key.
std::optional<std::filesystem::path> base_of(const toml::table& table, const std::string& name);

/// TOML text as a table. Throws ConfigurationError with file and line.
toml::table parse_config(std::string_view toml, const std::string& name);

/// The text's own layer last, before it that of its base, and so on: what a later one states
/// replaces what an earlier one does. Throws ConfigurationError for a base that is not there or
/// leads back.
std::vector<ConfigLayer> config_layers(std::string_view toml, const std::string& name);

/// The text of a layer with these values on top of the file `base` and what that builds on; where
/// `base` is empty, of these values alone. It may be kept in any folder.
std::string layer_over(const std::filesystem::path& base, const toml::table& values);

}  // namespace understory::bus
