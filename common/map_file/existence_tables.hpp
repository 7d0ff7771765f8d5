// The tables of the existence tracker's saved state; schema version 3.
#pragma once

#include <vector>

#include "common/map_file/connection.hpp"
#include "common/map_file/schema.hpp"

namespace understory::map_file {

/// The tables. They are content of maps, included in the history and the checksums.
std::vector<SchemaObject> existence_objects();
/// Lists the tables among the GeoPackage's extensions.
void register_existence_tables(const Connection& connection);
/// Whether the database has them: files of versions 1 and 2 opened for reading lack them.
bool has_existence_tables(const Connection& connection);

}  // namespace understory::map_file
