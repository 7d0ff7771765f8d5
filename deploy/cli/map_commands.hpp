// Parts of `understory map` in files of their own.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "common/map_file/map_file.hpp"

namespace understory::cli {

/// `understory map import`: converts a table of surveyed landmarks, or the maps in a log, into a
/// map file.
void add_map_import(CLI::App& map);
/// `understory map georeference`: sets the location of a file's maps on the earth.
void add_map_georeference(CLI::App& map);
/// `understory map export`: maps of a file as CSV and GeoJSON.
void add_map_export(CLI::App& map);

/// `understory map merge`: merges two overlapping maps.
void add_map_merge(CLI::App& map);
/// `understory map close`: closes a loop in a stored map by hand.
void add_map_close(CLI::App& map);

/// Runs `work`; an error of a file ends the command with one line.
void guarded_map_work(const std::function<void()>& work);
/// A note for a change with the present time.
map_file::ChangeNote note_now(std::string command, std::string source, std::string text);

/// The message that a file cannot be exported as GeoJSON, with the remedy.
std::string place_missing(const std::string& file);
/// The layers of a map as GeoJSON (RFC 7946: longitude and latitude of WGS 84, nine decimals), each
/// with its name. Layers without a feature are left out, except landmarks and trajectory. Throws
/// reference_system::ReferenceError.
std::vector<std::pair<std::string, std::string>> map_geojson(const map_file::StoredMap& map,
                                                             const model::MapReference& reference);

}  // namespace understory::cli
