#include "common/map_file/submap_tables.hpp"

#include <array>

namespace understory::map_file {
namespace {

/// All its content is in the frame of the submap, so a correction does not change it.
constexpr std::string_view kSubmaps = R"(CREATE TABLE understory_submaps (
  map_id INTEGER NOT NULL,
  submap_id INTEGER NOT NULL,
  utime INTEGER NOT NULL,
  content_hash INTEGER NOT NULL,
  state TEXT NOT NULL,
  replaces BLOB NOT NULL,
  border BLOB NOT NULL,
  landmarks BLOB NOT NULL,
  keyframes BLOB NOT NULL,
  payload BLOB NOT NULL,
  checksum TEXT NOT NULL,
  CONSTRAINT pk_understory_submaps PRIMARY KEY (map_id, submap_id)
))";
/// is_drawn: the layers show the submap at this pose.
constexpr std::string_view kPoses = R"(CREATE TABLE understory_submap_poses (
  map_id INTEGER NOT NULL,
  submap_id INTEGER NOT NULL,
  version INTEGER NOT NULL,
  x_m DOUBLE NOT NULL,
  y_m DOUBLE NOT NULL,
  heading_rad DOUBLE NOT NULL,
  is_drawn INTEGER NOT NULL,
  CONSTRAINT pk_understory_submap_poses PRIMARY KEY (map_id, submap_id)
) WITHOUT ROWID)";
constexpr std::string_view kToDraw =
    "CREATE INDEX understory_submaps_to_draw ON understory_submap_poses(map_id, submap_id) "
    "WHERE is_drawn = 0";
constexpr std::string_view kClosures = R"(CREATE TABLE understory_closures (
  number INTEGER NOT NULL PRIMARY KEY,
  map_id INTEGER NOT NULL,
  closure_id INTEGER NOT NULL,
  source TEXT NOT NULL,
  from_submap INTEGER NOT NULL,
  from_sequence INTEGER NOT NULL,
  to_submap INTEGER NOT NULL,
  to_sequence INTEGER NOT NULL,
  x_m DOUBLE NOT NULL,
  y_m DOUBLE NOT NULL,
  heading_rad DOUBLE NOT NULL,
  CONSTRAINT uk_understory_closures UNIQUE (map_id, closure_id)
))";

struct Table {
  std::string_view name;
  std::string_view sql;
};
constexpr std::array<Table, 3> kTables{{{"understory_submaps", kSubmaps},
                                        {"understory_submap_poses", kPoses},
                                        {"understory_closures", kClosures}}};

}  // namespace

std::vector<SchemaObject> submap_objects() {
  std::vector<SchemaObject> objects;
  objects.reserve(kTables.size() + 1);
  for (const Table& table : kTables)
    objects.push_back({std::string(table.name), std::string(table.sql)});
  objects.push_back({"understory_submaps_to_draw", std::string(kToDraw)});
  return objects;
}

void register_submap_tables(const Connection& connection) {
  Statement insert =
      connection.prepare("INSERT INTO gpkg_extensions VALUES (?1, NULL, ?2, ?3, ?4)");
  for (const Table& table : kTables) {
    insert
        .bind(table.name, std::string_view("understory_map"),
              std::string_view("Understory, docs/decisions/092-submap-store.md"),
              std::string_view("read-write"))
        .run();
  }
}

}  // namespace understory::map_file
