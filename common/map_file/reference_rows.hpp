// Location of the maps' frame on the earth: one row, and the rows that other programs read.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/map_file/connection.hpp"
#include "common/map_file/schema.hpp"
#include "common/model/map_reference.hpp"

namespace understory::map_file {

/// The table, in files from version 4 on.
std::vector<SchemaObject> reference_objects();
/// Registers the table for other programs.
void register_reference_table(const Connection& connection);

/// The location stated in the file; none without a location, and in files of older versions.
std::optional<model::MapReference> select_reference(const Connection& connection);
/// Writes the location and gives the geometries of all layers its number; coordinates stay. The
/// caller must update the maps' checksums. O(features).
void put_reference(const Connection& connection, const model::MapReference& reference);

/// The number of the geometries' reference system.
std::int32_t srs_of_layers(const Connection& connection);
/// Updates the rows by which other programs find the layers' reference system.
void refresh_registration(const Connection& connection);
/// Whether these rows are up to date.
bool is_registered(const Connection& connection);

}  // namespace understory::map_file
