// `--map` of the commands that run the mapper: a given map.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/bus/config_layers.hpp"

namespace understory::cli {

/// The process that receives the map, named as in launch.toml and in HEALTH.
inline constexpr const char* kMapperProcess = "geoslam_mapper";
/// The process that receives the existence of its landmarks.
inline constexpr const char* kTrackerProcess = "existence_tracker";

/// Values of the options.
struct GivenMapOptions {
  std::string file;          ///< A map file; empty = none.
  std::uint32_t map_id = 0;  ///< 0 = the only one in the file.
  bool localisation_only = false;

  /// Whether a map is given.
  bool is_given() const { return !file.empty(); }
};

/// Parameters from the options for the processes that receive the map.
struct GivenMapLayers {
  std::map<std::string, bus::ConfigLayer> layers;  ///< Their parameters, by process.
  std::string checksum;                            ///< SHA-256 of the map's content.
};

/// Adds --map, --map-id and --localisation-only.
void add_given_map_options(CLI::App& command, GivenMapOptions& options);

/// The resulting parameters for the mapper and, if it runs, the existence tracker, with `file` as
/// the map's path. The map is read once, so that a wrong one ends the command before any process
/// runs. Ends the command with status 2 where `processes` has no mapper. Throws
/// map_file::MapFileError or std::runtime_error with the file.
GivenMapLayers given_map_layers(const GivenMapOptions& options, const std::filesystem::path& file,
                                const std::vector<std::string>& processes);

/// Path of a process's layer file, beside its saved state.
std::filesystem::path layer_file(const std::filesystem::path& state_folder);
/// Writes that file, over the process's file `base` (empty: defaults). A saved state has priority
/// over a given map: the command ends with status 1 where there is a state that did not begin with
/// this layer.
void keep_layer(const std::filesystem::path& state_folder, const std::filesystem::path& base,
                const bus::ConfigLayer& layer, const std::string& checksum);

}  // namespace understory::cli
