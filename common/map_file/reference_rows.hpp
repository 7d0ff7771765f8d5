// Where the frame of a file's maps lies on the earth: one row, and what other programs read of it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/map_file/connection.hpp"
#include "common/map_file/schema.hpp"
#include "common/model/map_reference.hpp"

namespace understory::map_file {

/// The table, which files have from version 4 on.
std::vector<SchemaObject> reference_objects();
/// Tells other programs that the table is ours.
void register_reference_table(const Connection& connection);

/// What the file states; none where its frame lies nowhere, and in files of older versions.
std::optional<model::MapReference> select_reference(const Connection& connection);
/// States it, and gives the geometries of all layers its number; their coordinates stay. The
/// checksums of maps are stated anew by who calls. O(features).
void put_reference(const Connection& connection, const model::MapReference& reference);

/// The number of the reference system that geometries state.
std::int32_t srs_of_layers(const Connection& connection);
/// Brings the rows by which other programs find the layers' system in step with what the file
/// states.
void refresh_registration(const Connection& connection);
/// Whether they are.
bool is_registered(const Connection& connection);

}  // namespace understory::map_file
