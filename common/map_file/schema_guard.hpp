// Protects against SQL in a foreign map file that would run in our statements.
//
// A GeoPackage has a schema of its own: triggers, indexes of expressions and computed columns run
// inside the statements of the program that writes the file.
#pragma once

#include <string>
#include <vector>

#include "common/map_file/connection.hpp"

namespace understory::map_file {

/// One line for each object that would run when our tables are written, and for each object with
/// one of our names but another definition. Columns, layers, styles and indexes of columns added by
/// QGIS or GDAL are allowed. Precondition: verify_schema() passed. O(schema); nothing is run.
std::vector<std::string> foreign_sql_in(const Connection& connection);

/// Throws Fault::kUntrusted with what foreign_sql_in() found, in one line. If there is none, the
/// connection's schema is trusted from here on, so that the layers' triggers can access their
/// index.
void require_own_sql(const Connection& connection);

/// Statements of this connection fail (Fault::kUntrusted) if they would run a trigger or view whose
/// name is not one of ours.
void deny_foreign_sql(sqlite3* handle);

}  // namespace understory::map_file
