// `--map` of the commands that run the mapper: a map to begin with.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/bus/config_layers.hpp"

namespace understory::cli {

/// The process that is given the map, as in launch.toml and in HEALTH.
inline constexpr const char* kMapperProcess = "geoslam_mapper";
/// The process that is given what is known of the existence of its landmarks.
inline constexpr const char* kTrackerProcess = "existence_tracker";

/// What the options say.
struct GivenMapOptions {
  std::string file;          ///< A map file; empty: none is given.
  std::uint32_t map_id = 0;  ///< 0: the only one in the file.
  bool localisation_only = false;

  /// Whether a map is given.
  bool is_given() const { return !file.empty(); }
};

/// What the options mean for the processes that are given the map.
struct GivenMapLayers {
  std::map<std::string, bus::ConfigLayer> layers;  ///< Their parameters, by process.
  std::string checksum;                            ///< SHA-256 of the map's content.
};

/// Adds --map, --map-id and --localisation-only.
void add_given_map_options(CLI::App& command, GivenMapOptions& options);

/// The parameters that follow, for the mapper and, where it runs, the existence tracker, with
/// `file` as the map's path. The map is read once, so that a wrong one ends the command before
/// anything runs. Ends it with status 2 where `processes` has no mapper. Throws
/// map_file::MapFileError or std::runtime_error, which name the file.
GivenMapLayers given_map_layers(const GivenMapOptions& options, const std::filesystem::path& file,
                                const std::vector<std::string>& processes);

/// Where a process's layer is kept: beside its saved state.
std::filesystem::path layer_file(const std::filesystem::path& state_folder);
/// Writes that file, over the process's file `base` (empty: defaults). A state goes before a given
/// map: the command ends with status 1 where there is one that did not begin with this layer.
void keep_layer(const std::filesystem::path& state_folder, const std::filesystem::path& base,
                const bus::ConfigLayer& layer, const std::string& checksum);

}  // namespace understory::cli
