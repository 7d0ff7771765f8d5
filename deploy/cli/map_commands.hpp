// Parts of `understory map` that have a file of their own.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "common/map_file/map_file.hpp"

namespace understory::cli {

/// `understory map import`: a table of surveyed landmarks, or the maps in a log, into a map file.
void add_map_import(CLI::App& map);
/// `understory map georeference`: where the frame of a file's maps lies on the earth.
void add_map_georeference(CLI::App& map);
/// `understory map export`: maps of a file as CSV and GeoJSON.
void add_map_export(CLI::App& map);

/// `understory map merge`: two maps that overlap become one.
void add_map_merge(CLI::App& map);
/// `understory map close`: a loop closed in a stored map by a person.
void add_map_close(CLI::App& map);

/// Runs `work`; what is wrong with a file ends the command in one line.
void guarded_map_work(const std::function<void()>& work);
/// A note for a change that is made now.
map_file::ChangeNote note_now(std::string command, std::string source, std::string text);

/// Why a file cannot be given out as GeoJSON, and what helps.
std::string place_missing(const std::string& file);
/// The layers of a map as GeoJSON (RFC 7946: longitude and latitude of WGS 84, nine decimals), each
/// with its name. Layers without a feature are left out, but for landmarks and trajectory. Throws
/// reference_system::ReferenceError.
std::vector<std::pair<std::string, std::string>> map_geojson(const map_file::StoredMap& map,
                                                             const model::MapReference& reference);

}  // namespace understory::cli
