// What a map file of somebody else brings along that would act in our statements.
//
// A GeoPackage is a database with a schema of its own: triggers, indexes of expressions and columns
// that are computed run inside of the statements of whoever writes the file.
#pragma once

#include <string>
#include <vector>

#include "common/map_file/connection.hpp"

namespace understory::map_file {

/// All in the schema that would act when our tables are written, and what has the name of an object
/// of ours and is something else, a line each. Columns, layers, styles and indexes of columns that
/// QGIS or GDAL add are none of that. The file has passed verify_schema(). O(schema), nothing runs.
std::vector<std::string> foreign_sql_in(const Connection& connection);

/// Throws Fault::kUntrusted with what foreign_sql_in() found, in one line. Where there is nothing,
/// the connection's schema is trusted from here on: the layers' triggers reach their index.
void require_own_sql(const Connection& connection);

/// Statements of this connection fail (Fault::kUntrusted) where a trigger or a view would run that
/// is not one of ours by its name.
void deny_foreign_sql(sqlite3* handle);

}  // namespace understory::map_file
