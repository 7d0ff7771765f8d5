// The SQL functions that maintain a GeoPackage's spatial index.
#pragma once

struct sqlite3;

namespace understory::map_file {

/// Adds ST_IsEmpty, ST_MinX, ST_MaxX, ST_MinY and ST_MaxY to a connection, which the triggers of
/// the R*Tree extension call (OGC 12-128, F.3). For bytes that are no geometry they return NULL,
/// ST_IsEmpty 1. Throws std::bad_alloc.
void register_geometry_functions(sqlite3* connection);

}  // namespace understory::map_file
