#include "common/map_file/existence_tables.hpp"

#include <array>

namespace understory::map_file {
namespace {

constexpr std::string_view kExistenceStates = R"(CREATE TABLE existence_states (
  landmark_id INTEGER NOT NULL PRIMARY KEY,
  map_id INTEGER NOT NULL REFERENCES understory_maps(map_id),
  utime INTEGER NOT NULL,
  probability DOUBLE NOT NULL,
  in_use INTEGER NOT NULL,
  state BLOB NOT NULL
))";
constexpr std::string_view kExistenceModels = R"(CREATE TABLE existence_models (
  map_id INTEGER NOT NULL PRIMARY KEY REFERENCES understory_maps(map_id),
  utime INTEGER NOT NULL,
  model BLOB NOT NULL
))";

struct ExistenceTable {
  std::string_view name;
  std::string_view sql;
};
constexpr std::array<ExistenceTable, 2> kExistenceTables{
    {{"existence_states", kExistenceStates}, {"existence_models", kExistenceModels}}};

}  // namespace

std::vector<SchemaObject> existence_objects() {
  std::vector<SchemaObject> objects;
  objects.reserve(kExistenceTables.size());
  for (const ExistenceTable& table : kExistenceTables)
    objects.push_back({std::string(table.name), std::string(table.sql)});
  return objects;
}

void register_existence_tables(const Connection& connection) {
  Statement insert =
      connection.prepare("INSERT INTO gpkg_extensions VALUES (?1, NULL, ?2, ?3, ?4)");
  for (const ExistenceTable& table : kExistenceTables) {
    insert
        .bind(table.name, std::string_view("understory_map"),
              std::string_view("Understory, docs/decisions/111-existence-in-map-files.md"),
              std::string_view("read-write"))
        .run();
  }
}

bool has_existence_tables(const Connection& connection) {
  return connection.number(
             "SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name = "
             "'existence_states'") > 0;
}

}  // namespace understory::map_file
