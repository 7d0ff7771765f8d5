// The SQL functions that a GeoPackage's index of places is kept by.
#pragma once

struct sqlite3;

namespace understory::map_file {

/// Gives a connection ST_IsEmpty, ST_MinX, ST_MaxX, ST_MinY and ST_MaxY, which the triggers of the
/// R*Tree extension call (OGC 12-128, F.3). Of what is no geometry they give NULL, ST_IsEmpty 1.
/// Throws std::bad_alloc.
void register_geometry_functions(sqlite3* connection);

}  // namespace understory::map_file
