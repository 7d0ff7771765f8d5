// Comparison of a schema's definitions by their meaning.
#pragma once

#include <string_view>

namespace understory::map_file {

/// Whether two definitions are the same to SQLite by their words alone: spaces, the case of words,
/// and quotes around names that are no keywords are ignored. Comments are a difference.
bool is_same_sql(std::string_view ours, std::string_view theirs);

/// Whether the table `theirs` is `ours` plus columns at its end in the form of attributes of other
/// programs: name, type, NOT NULL, a constant as DEFAULT. Computed columns, checks, keys,
/// references and collations are not allowed.
bool adds_plain_columns(std::string_view ours, std::string_view theirs);

/// Whether it defines an R*Tree in GeoPackage's form, with any name.
bool is_geopackage_index(std::string_view sql);

/// Whether it defines a virtual table.
bool is_virtual_table(std::string_view sql);

}  // namespace understory::map_file
