#include "common/map_file/schema_guard.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>

#include "common/map_file/schema.hpp"
#include "common/map_file/sql_text.hpp"

namespace understory::map_file {
namespace {

using Lines = std::vector<std::string>;
using Names = std::set<std::string, std::less<>>;

/// Findings that one line of an error lists.
constexpr std::size_t kMostListed = 5;
constexpr std::size_t kLongestName = 60;

/// A row of sqlite_schema.
struct Definition {
  std::string type;
  std::string name;
  std::string table;
  std::string sql;
};

/// By name.
using Definitions = std::map<std::string, Definition, std::less<>>;

std::vector<Definition> definitions_in(const Connection& connection) {
  std::vector<Definition> definitions;
  Statement row = connection.prepare("SELECT type, name, tbl_name, sql FROM sqlite_schema");
  while (row.step()) definitions.push_back({row.text(0), row.text(1), row.text(2), row.text(3)});
  return definitions;
}

/// GDAL counts the features of a layer with these objects, if a file has them.
std::vector<SchemaObject> counting_objects() {
  std::vector<SchemaObject> objects{
      {"gpkg_ogr_contents",
       "CREATE TABLE gpkg_ogr_contents(table_name TEXT NOT NULL PRIMARY KEY,"
       "feature_count INTEGER DEFAULT NULL)"}};
  std::vector<std::string_view> tables{"understory_maps"};
  for (const Layer& layer : kLayers) tables.push_back(layer.table);
  for (const std::string_view table : tables) {
    for (const auto& [event, sign] : {std::pair{"insert", '+'}, std::pair{"delete", '-'}})
      objects.push_back({fmt::format("trigger_{}_feature_count_{}", event, table),
                         fmt::format("CREATE TRIGGER trigger_{0}_feature_count_{1} AFTER {0} ON "
                                     "{1} BEGIN UPDATE gpkg_ogr_contents SET feature_count = "
                                     "feature_count {2} 1 WHERE lower(table_name) = lower('{1}'); "
                                     "END",
                                     event, table, sign)});
  }
  return objects;
}

/// The definitions in a file of a version, in SQLite's form, including the tables of the R*Trees.
Definitions own_definitions(std::int64_t version) {
  const Connection empty("(a new file)");
  for (const SchemaObject& object : schema_objects(version)) empty.execute(object.sql);
  for (const SchemaObject& object : counting_objects()) empty.execute(object.sql);
  Definitions own;
  for (Definition& one : definitions_in(empty)) own[one.name] = std::move(one);
  return own;
}

const Definitions& own_schema(std::int64_t version) {
  static const std::array<Definitions, kSchemaVersion> kOwn = [] {
    std::array<Definitions, kSchemaVersion> all;
    for (std::int64_t one = kOldestSchemaVersion; one <= kSchemaVersion; ++one)
      all.at(static_cast<std::size_t>(one - 1)) = own_definitions(one);
    return all;
  }();
  return kOwn.at(static_cast<std::size_t>(version - 1));
}

const Names& own_triggers() {
  static const Names kTriggers = [] {
    Names names;
    for (const auto& [name, one] : own_schema(kSchemaVersion))
      if (one.type == "trigger") names.insert(name);
    return names;
  }();
  return kTriggers;
}

/// Names of others are shown as one line, without control characters.
std::string shown_name(std::string_view name) {
  std::string text(name.substr(0, kLongestName));
  std::ranges::replace_if(
      text, [](char one) { return static_cast<unsigned char>(one) < 0x20 || one == 0x7F; }, '?');
  return "'" + text + "'";
}

std::string lower_name(std::string_view name) {
  std::string text(name);
  for (char& one : text)
    if (one >= 'A' && one <= 'Z') one = static_cast<char>(one - 'A' + 'a');
  return text;
}

/// Whether other programs may add attributes to the table: only to the listed layers.
bool may_have_attributes(std::string_view table) {
  return table == "understory_maps" ||
         std::ranges::find(kLayers, table, &Layer::table) != kLayers.end();
}

bool is_as_ours(const Definition& own, const Definition& other) {
  if (own.type != other.type) return false;
  return is_same_sql(own.sql, other.sql) || is_standard_trigger(own.name, other.sql) ||
         (own.type == "table" && may_have_attributes(own.name) &&
          adds_plain_columns(own.sql, other.sql));
}

/// Checks a definition by its name and text; check_triggers() finds triggers that SQLite would run.
void check_definition(const Definition& one, const Definitions& own, Lines& findings) {
  const std::string name = lower_name(one.name);
  if (const auto found = own.find(name); found != own.end()) {
    if (!is_as_ours(found->second, one))
      findings.push_back(fmt::format("{}: its definition is not ours", name));
  } else if (own_schema(kSchemaVersion).contains(name)) {
    findings.push_back(fmt::format("{} {}: has the name of an object of later versions", one.type,
                                   shown_name(one.name)));
  } else if (one.type == "table" && is_virtual_table(one.sql) && !is_geopackage_index(one.sql)) {
    findings.push_back(fmt::format("virtual table {}: is no index of places of a GeoPackage",
                                   shown_name(one.name)));
  }
}

/// Our tables into which rows are written.
std::vector<std::string> written_tables(const Definitions& own) {
  std::vector<std::string> tables;
  for (const auto& [name, one] : own) {
    const bool is_written = !name.starts_with("rtree_") && name != "gpkg_ogr_contents";
    if (one.type == "table" && is_written) tables.push_back(name);
  }
  return tables;
}

/// A plain index of columns is harmless. A unique one would make REPLACE delete other rows;
/// expressions, conditions and collations would run.
void check_indexes(const Connection& connection, std::string_view table, const Definitions& own,
                   Lines& findings) {
  Statement index = connection.prepare(
      "SELECT name, \"unique\" != 0 OR partial != 0 OR EXISTS (SELECT 1 FROM pragma_index_xinfo("
      "i.name) WHERE cid = -2 OR coll != 'BINARY') FROM pragma_index_list(?1) AS i "
      "WHERE origin = 'c'");
  index.bind(table);
  while (index.step()) {
    const std::string name = index.text(0);
    if (index.integer(1) != 0 && !own.contains(name))
      findings.push_back(
          fmt::format("index {}: is more than an index of columns of {}", shown_name(name), table));
  }
}

std::string sql_name(std::string_view name) {
  std::string text = "\"";
  for (const char one : name) text += one == '"' ? "\"\"" : std::string(1, one);
  return text + '"';
}

/// Statements that cover all effects of writing the table.
std::vector<std::string> writings_of(const Connection& connection, std::string_view table) {
  std::string columns;
  Statement column = connection.prepare("SELECT name FROM pragma_table_info(?1)");
  column.bind(table);
  while (column.step()) {
    const std::string name = sql_name(column.text(0));
    columns += fmt::format("{}{} = {}", columns.empty() ? "" : ", ", name, name);
  }
  const std::string name = sql_name(table);
  return {fmt::format("INSERT INTO {} DEFAULT VALUES", name),
          fmt::format("UPDATE {} SET {}", name, columns), fmt::format("DELETE FROM {}", name)};
}

int deny_others(void* /*context*/, int /*action*/, const char* /*what*/, const char* /*where*/,
                const char* /*database*/, const char* source) {
  return source == nullptr || own_triggers().contains(std::string_view(source)) ? SQLITE_OK
                                                                                : SQLITE_DENY;
}

int note_others(void* context, int /*action*/, const char* /*what*/, const char* /*where*/,
                const char* /*database*/, const char* source) {
  if (source == nullptr || own_triggers().contains(std::string_view(source))) return SQLITE_OK;
  try {
    static_cast<Names*>(context)->insert(source);
  } catch (...) {
    return SQLITE_DENY;
  }
  return SQLITE_OK;
}

/// During its lifetime SQLite reports the triggers and views that it would run; no statement may be
/// stepped.
class Listening {
 public:
  explicit Listening(const Connection& connection) : connection_(connection) {
    was_trusted_ = connection.is_schema_trusted();
    connection.trust_schema(true);
    sqlite3_set_authorizer(connection.handle(), note_others, &names_);
  }
  ~Listening() {
    deny_foreign_sql(connection_.handle());
    connection_.trust_schema(was_trusted_);
  }
  Listening(const Listening&) = delete;
  Listening& operator=(const Listening&) = delete;

  /// Names reported since the last call.
  Names take() { return std::exchange(names_, {}); }

 private:
  const Connection& connection_;
  bool was_trusted_ = false;
  Names names_;
};

/// SQLite compiles the triggers of a statement, and the triggers of their writes, in prepare: it
/// reports itself what would run.
void check_triggers(const Connection& connection, const std::string& table, Lines& findings) {
  const std::vector<std::string> writings = writings_of(connection, table);
  Names found;
  Listening listening(connection);
  for (const std::string& sql : writings) {
    std::string fault;
    try {
      const Statement ignored = connection.prepare(sql);
    } catch (const MapFileError& error) {
      fault = error.what();
    }
    const Names names = listening.take();
    found.insert(names.begin(), names.end());
    if (!fault.empty() && names.empty())
      findings.push_back(fmt::format("{}: cannot be written: {}", table, fault));
  }
  for (const std::string& name : found)
    findings.push_back(fmt::format("trigger {}: acts when {} is written", shown_name(name), table));
}

}  // namespace

std::vector<std::string> foreign_sql_in(const Connection& connection) {
  const Definitions& own = own_schema(schema_version(connection));
  const std::vector<Definition> definitions = definitions_in(connection);
  Lines findings;
  for (const Definition& one : definitions) check_definition(one, own, findings);

  for (const std::string& table : written_tables(own)) {
    const auto found = std::ranges::find(definitions, table, &Definition::name);
    if (found == definitions.end() || !is_as_ours(own.at(table), *found)) continue;
    check_indexes(connection, table, own, findings);
    check_triggers(connection, table, findings);
  }
  return findings;
}

void require_own_sql(const Connection& connection) {
  const Lines findings = foreign_sql_in(connection);
  if (findings.empty()) return connection.trust_schema(true);
  const std::size_t listed = std::min(findings.size(), kMostListed);
  std::string line =
      fmt::format("{}: is not written, since SQL in it is not ours: {}", connection.file().string(),
                  fmt::join(findings.begin(), findings.begin() + listed, "; "));
  if (listed < findings.size()) line += fmt::format("; and {} more", findings.size() - listed);
  throw MapFileError(Fault::kUntrusted, line);
}

void deny_foreign_sql(sqlite3* handle) {
  own_triggers();  // Computed before SQLite calls back, where no exception may pass.
  sqlite3_set_authorizer(handle, deny_others, nullptr);
}

}  // namespace understory::map_file
