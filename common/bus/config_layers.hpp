// A configuration file and its base files, named by the key `base`.
#pragma once

#include <toml++/toml.h>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace understory::bus {

/// The key that names the file (or, in launch.toml, the folder) that is the base of this one.
inline constexpr std::string_view kBaseKey = "base";

/// The values of one file, without its base.
struct ConfigLayer {
  std::string name;  ///< Name for messages: the path that led to it.
  toml::table table;
};

/// "leads back: a -> b -> a" where `next` is one of `files`; else empty.
std::string cycle_in(const std::vector<std::filesystem::path>& files,
                     const std::filesystem::path& next);

/// The path that the key `base` of a file names, relative to the file's folder; none where the key
/// is missing or empty. Throws ConfigurationError with file, line and key.
std::optional<std::filesystem::path> base_of(const toml::table& table, const std::string& name);

/// TOML text as a table. Throws ConfigurationError with file and line.
toml::table parse_config(std::string_view toml, const std::string& name);

/// The layers of the text and its bases, the text's own layer last: values of a later layer replace
/// those of an earlier one. Throws ConfigurationError for a missing or circular base.
std::vector<ConfigLayer> config_layers(std::string_view toml, const std::string& name);

/// Text of a layer with these values and the base file `base`; where `base` is empty, of these
/// values alone. The text is valid in any folder.
std::string layer_over(const std::filesystem::path& base, const toml::table& values);

}  // namespace understory::bus
