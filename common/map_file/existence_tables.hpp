// The tables that keep what the existence tracker goes on with; schema version 3.
#pragma once

#include <vector>

#include "common/map_file/connection.hpp"
#include "common/map_file/schema.hpp"

namespace understory::map_file {

/// The tables. They are content of maps: the history and the checksums have them.
std::vector<SchemaObject> existence_objects();
/// Lists the tables among the GeoPackage's extensions.
void register_existence_tables(const Connection& connection);
/// Whether the database has them: files of versions 1 and 2 that are open to read have not.
bool has_existence_tables(const Connection& connection);

}  // namespace understory::map_file
