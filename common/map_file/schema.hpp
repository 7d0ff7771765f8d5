// Tables, triggers and fixed rows of a map file.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/map_file/connection.hpp"
#include "common/map_file/stored_map.hpp"

namespace understory::map_file {

/// The written version of the schema. A change of a table or a column gets the next number.
inline constexpr std::int64_t kSchemaVersion = 4;
/// The oldest readable version. Version 1 has no submaps (submap_tables.hpp), versions 1 and 2 no
/// states of existence (existence_tables.hpp), versions 1 to 3 no place on the earth
/// (reference_rows.hpp), and triggers that abort an UPDATE of other programs without functions for
/// geometries. A file opened for writing is upgraded to the written version; nothing else in it
/// changes.
inline constexpr std::int64_t kOldestSchemaVersion = 1;
/// PRAGMA application_id of a GeoPackage: "GPKG".
inline constexpr std::int64_t kGeoPackage = 0x47504B47;
/// PRAGMA user_version: GeoPackage 1.3.
inline constexpr std::int64_t kGeoPackageVersion = 10300;

/// A table of features, shown as a layer by other programs. Its geometry is in the column `geom`.
struct Layer {
  std::string_view table;
  std::string_view key;       ///< Its primary key: the feature's number.
  std::string_view geometry;  ///< POINT, LINESTRING, POLYGON.
  std::string_view text;      ///< Description for people.
};

/// All layers.
inline constexpr std::array<Layer, 4> kLayers{{
    {"landmarks", "landmark_id", "POINT", "Landmarks with covariance [m^2]"},
    {"trajectory", "fid", "POINT", "Keyframes with heading and covariance [m, rad]"},
    {"submap_borders", "fid", "POLYGON", "Where each submap lies"},
    {"loop_closures", "fid", "LINESTRING", "Keyframes between which a loop was closed"},
}};
/// The tables with maps' content, recorded by the history.
inline constexpr std::array<std::string_view, 8> kContentTables{
    "understory_maps", "landmarks",        "trajectory",       "submap_borders",
    "loop_closures",   "existence_states", "existence_models", "understory_reference"};

/// One object of the schema: its name, and its SQL.
struct SchemaObject {
  std::string name;
  std::string sql;
};

/// All objects in a file of a version, in order of creation.
std::vector<SchemaObject> schema_objects(std::int64_t version = kSchemaVersion);

/// Whether it is a trigger of a layer's index as in the standard, as GDAL rewrites it.
bool is_standard_trigger(std::string_view name, std::string_view sql);

/// Creates all objects in an empty database, in a transaction begun by the caller.
void create_schema(const Connection& connection);

/// Throws MapFileError where the database is no GeoPackage, not one of ours, has an unreadable
/// schema version, or lacks a table. O(1).
void verify_schema(const Connection& connection);
/// The schema version of a file that passed verify_schema().
std::int64_t schema_version(const Connection& connection);
/// Upgrades a file of an older version to kSchemaVersion, in a transaction of its own; no effect if
/// it has this version.
void upgrade_schema(const Connection& connection);

/// Writes the version of the program that wrote the file last; for people only, readers do not use
/// it.
void state_program(const Connection& connection);
/// The version of that program; empty in older files.
std::string program_of(const Connection& connection);

/// Updates rectangles, times of change and reference systems in gpkg_contents. `utime` [us].
void refresh_contents(const Connection& connection, model::Utime utime);

}  // namespace understory::map_file
