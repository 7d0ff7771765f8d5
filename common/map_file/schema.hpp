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

/// The version of the schema that is written. One that adds or changes a table or a column gets the
/// next number.
inline constexpr std::int64_t kSchemaVersion = 4;
/// The oldest version that is read. Version 1 has no submaps (submap_tables.hpp), versions 1
/// and 2 no states of existence (existence_tables.hpp), versions 1 to 3 no place on the earth
/// (reference_rows.hpp), and triggers that end an UPDATE of other programs without functions for
/// geometries. A file that is opened to write becomes one of the version that is written; nothing
/// else in it changes.
inline constexpr std::int64_t kOldestSchemaVersion = 1;
/// PRAGMA application_id of a GeoPackage: "GPKG".
inline constexpr std::int64_t kGeoPackage = 0x47504B47;
/// PRAGMA user_version: GeoPackage 1.3.
inline constexpr std::int64_t kGeoPackageVersion = 10300;

/// A table of features, which other programs show as a layer. Its geometry is in the column `geom`.
struct Layer {
  std::string_view table;
  std::string_view key;       ///< Its primary key: the feature's number.
  std::string_view geometry;  ///< POINT, LINESTRING, POLYGON.
  std::string_view text;      ///< What it holds, for people.
};

/// All layers.
inline constexpr std::array<Layer, 4> kLayers{{
    {"landmarks", "landmark_id", "POINT", "Landmarks with covariance [m^2]"},
    {"trajectory", "fid", "POINT", "Keyframes with heading and covariance [m, rad]"},
    {"submap_borders", "fid", "POLYGON", "Where each submap lies"},
    {"loop_closures", "fid", "LINESTRING", "Keyframes between which a loop was closed"},
}};
/// The tables whose rows are a map's content, and which the history records.
inline constexpr std::array<std::string_view, 8> kContentTables{
    "understory_maps", "landmarks",        "trajectory",       "submap_borders",
    "loop_closures",   "existence_states", "existence_models", "understory_reference"};

/// One object of the schema: its name, and the SQL that makes it.
struct SchemaObject {
  std::string name;
  std::string sql;
};

/// Everything that a file of a version has, in the order in which it is made.
std::vector<SchemaObject> schema_objects(std::int64_t version = kSchemaVersion);

/// Whether it is a trigger of a layer's index as the standard has it, and GDAL makes it anew.
bool is_standard_trigger(std::string_view name, std::string_view sql);

/// Makes everything in an empty database, in one transaction that the caller has begun.
void create_schema(const Connection& connection);

/// Throws MapFileError where the database is no GeoPackage, none of ours, of a schema version that
/// is not read, or lacks a table. O(1).
void verify_schema(const Connection& connection);
/// The version that a file states which verify_schema() has passed.
std::int64_t schema_version(const Connection& connection);
/// Makes a file of an older version one of kSchemaVersion, in a transaction of its own; nothing
/// where it is one.
void upgrade_schema(const Connection& connection);

/// States that this version of the program wrote the file last; for people, no reader goes by it.
void state_program(const Connection& connection);
/// The version that the file states so; empty in files of before that was stated.
std::string program_of(const Connection& connection);

/// The rectangles, times of change and reference systems that gpkg_contents states. `utime` [us].
void refresh_contents(const Connection& connection, model::Utime utime);

}  // namespace understory::map_file
