#include "common/map_file/schema.hpp"

#include <fmt/format.h>

#include "common/map_file/existence_tables.hpp"
#include "common/map_file/geometry_blob.hpp"
#include "common/map_file/reference_rows.hpp"
#include "common/map_file/sql_text.hpp"
#include "common/map_file/submap_tables.hpp"
#include "common/model/program_version.hpp"

namespace understory::map_file {
namespace {

/// Tables of OGC 12-128 (1.3), annex C.
constexpr std::string_view kSpatialRefSys = R"(CREATE TABLE gpkg_spatial_ref_sys (
  srs_name TEXT NOT NULL,
  srs_id INTEGER NOT NULL PRIMARY KEY,
  organization TEXT NOT NULL,
  organization_coordsys_id INTEGER NOT NULL,
  definition TEXT NOT NULL,
  description TEXT
))";
constexpr std::string_view kContents = R"(CREATE TABLE gpkg_contents (
  table_name TEXT NOT NULL PRIMARY KEY,
  data_type TEXT NOT NULL,
  identifier TEXT UNIQUE,
  description TEXT DEFAULT '',
  last_change DATETIME NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')),
  min_x DOUBLE,
  min_y DOUBLE,
  max_x DOUBLE,
  max_y DOUBLE,
  srs_id INTEGER,
  CONSTRAINT fk_gc_r_srs_id FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id)
))";
constexpr std::string_view kGeometryColumns = R"(CREATE TABLE gpkg_geometry_columns (
  table_name TEXT NOT NULL,
  column_name TEXT NOT NULL,
  geometry_type_name TEXT NOT NULL,
  srs_id INTEGER NOT NULL,
  z TINYINT NOT NULL,
  m TINYINT NOT NULL,
  CONSTRAINT pk_geom_cols PRIMARY KEY (table_name, column_name),
  CONSTRAINT uk_gc_table_name UNIQUE (table_name),
  CONSTRAINT fk_gc_tn FOREIGN KEY (table_name) REFERENCES gpkg_contents(table_name),
  CONSTRAINT fk_gc_srs FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id)
))";
constexpr std::string_view kExtensions = R"(CREATE TABLE gpkg_extensions (
  table_name TEXT,
  column_name TEXT,
  extension_name TEXT NOT NULL,
  definition TEXT NOT NULL,
  scope TEXT NOT NULL,
  CONSTRAINT ge_tce UNIQUE (table_name, column_name, extension_name)
))";

constexpr std::string_view kMeta = R"(CREATE TABLE understory_meta (
  key TEXT NOT NULL PRIMARY KEY,
  value TEXT NOT NULL
))";
constexpr std::string_view kMaps = R"(CREATE TABLE understory_maps (
  map_id INTEGER NOT NULL PRIMARY KEY,
  name TEXT NOT NULL,
  created_utime INTEGER NOT NULL,
  origin TEXT NOT NULL,
  checksum TEXT NOT NULL
))";
constexpr std::string_view kHistory = R"(CREATE TABLE understory_history (
  number INTEGER NOT NULL PRIMARY KEY,
  utime INTEGER NOT NULL,
  command TEXT NOT NULL,
  source TEXT NOT NULL,
  text TEXT NOT NULL,
  changeset BLOB NOT NULL,
  changeset_bytes INTEGER NOT NULL,
  checksum TEXT NOT NULL
))";

constexpr std::string_view kLandmarks = R"(CREATE TABLE landmarks (
  landmark_id INTEGER NOT NULL PRIMARY KEY,
  geom POINT NOT NULL,
  map_id INTEGER NOT NULL REFERENCES understory_maps(map_id),
  submap_id INTEGER,
  covariance_xx_m2 DOUBLE,
  covariance_xy_m2 DOUBLE,
  covariance_yy_m2 DOUBLE,
  diameter_m DOUBLE,
  kind TEXT NOT NULL,
  times_seen INTEGER NOT NULL,
  existence DOUBLE
))";
constexpr std::string_view kTrajectory = R"(CREATE TABLE trajectory (
  fid INTEGER NOT NULL PRIMARY KEY,
  geom POINT NOT NULL,
  map_id INTEGER NOT NULL REFERENCES understory_maps(map_id),
  sequence INTEGER NOT NULL,
  utime INTEGER NOT NULL,
  heading_rad DOUBLE NOT NULL,
  covariance_xx_m2 DOUBLE,
  covariance_xy_m2 DOUBLE,
  covariance_yy_m2 DOUBLE,
  covariance_xt_m_rad DOUBLE,
  covariance_yt_m_rad DOUBLE,
  covariance_tt_rad2 DOUBLE
))";
constexpr std::string_view kSubmapBorders = R"(CREATE TABLE submap_borders (
  fid INTEGER NOT NULL PRIMARY KEY,
  geom POLYGON NOT NULL,
  map_id INTEGER NOT NULL REFERENCES understory_maps(map_id),
  submap_id INTEGER NOT NULL
))";
constexpr std::string_view kLoopClosures = R"(CREATE TABLE loop_closures (
  fid INTEGER NOT NULL PRIMARY KEY,
  geom LINESTRING NOT NULL,
  map_id INTEGER NOT NULL REFERENCES understory_maps(map_id),
  from_sequence INTEGER NOT NULL,
  to_sequence INTEGER NOT NULL
))";

constexpr std::string_view kWgs84 =
    R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563,AUTHORITY["EPSG","7030"]],AUTHORITY["EPSG","6326"]],PRIMEM["Greenwich",0,AUTHORITY["EPSG","8901"]],UNIT["degree",0.0174532925199433,AUTHORITY["EPSG","9122"]],AXIS["Latitude",NORTH],AXIS["Longitude",EAST],AUTHORITY["EPSG","4326"]])";

/// OGC 12-128 (1.3), F.3: the index of a layer and its triggers. <t> is the layer, <i> its key, <e>
/// an event.
struct IndexPart {
  std::string_view suffix;
  std::string_view sql;
};
/// The events of update3 and update4, for a feature that gets another number. With UPDATE of any
/// column, as in the standard, SQLite would compile ST_IsEmpty into each UPDATE, and a plain
/// sqlite3 without this function could not change attributes. `ON` begins a line, because GDAL
/// treats " AFTER UPDATE OF ... ON " in update3 as an error of GeoPackage 1.0 and rewrites it.
constexpr std::string_view kAnyUpdate = "AFTER UPDATE ON <t>";
constexpr std::string_view kUpdateOfKey = "AFTER UPDATE OF <i>\nON <t>";
constexpr IndexPart kIndexParts[] = {
    {"", "CREATE VIRTUAL TABLE rtree_<t>_geom USING rtree(id, minx, maxx, miny, maxy)"},
    {"_insert", R"(CREATE TRIGGER rtree_<t>_geom_insert AFTER INSERT ON <t>
  WHEN (NEW.geom NOT NULL AND NOT ST_IsEmpty(NEW.geom))
BEGIN
  INSERT OR REPLACE INTO rtree_<t>_geom VALUES (
    NEW.<i>,
    ST_MinX(NEW.geom), ST_MaxX(NEW.geom),
    ST_MinY(NEW.geom), ST_MaxY(NEW.geom)
  );
END)"},
    {"_update1", R"(CREATE TRIGGER rtree_<t>_geom_update1 AFTER UPDATE OF geom ON <t>
  WHEN OLD.<i> = NEW.<i> AND
       (NEW.geom NOTNULL AND NOT ST_IsEmpty(NEW.geom))
BEGIN
  INSERT OR REPLACE INTO rtree_<t>_geom VALUES (
    NEW.<i>,
    ST_MinX(NEW.geom), ST_MaxX(NEW.geom),
    ST_MinY(NEW.geom), ST_MaxY(NEW.geom)
  );
END)"},
    {"_update2", R"(CREATE TRIGGER rtree_<t>_geom_update2 AFTER UPDATE OF geom ON <t>
  WHEN OLD.<i> = NEW.<i> AND
       (NEW.geom ISNULL OR ST_IsEmpty(NEW.geom))
BEGIN
  DELETE FROM rtree_<t>_geom WHERE id = OLD.<i>;
END)"},
    {"_update3", R"(CREATE TRIGGER rtree_<t>_geom_update3 <e>
  WHEN OLD.<i> != NEW.<i> AND
       (NEW.geom NOTNULL AND NOT ST_IsEmpty(NEW.geom))
BEGIN
  DELETE FROM rtree_<t>_geom WHERE id = OLD.<i>;
  INSERT OR REPLACE INTO rtree_<t>_geom VALUES (
    NEW.<i>,
    ST_MinX(NEW.geom), ST_MaxX(NEW.geom),
    ST_MinY(NEW.geom), ST_MaxY(NEW.geom)
  );
END)"},
    {"_update4", R"(CREATE TRIGGER rtree_<t>_geom_update4 <e>
  WHEN OLD.<i> != NEW.<i> AND
       (NEW.geom ISNULL OR ST_IsEmpty(NEW.geom))
BEGIN
  DELETE FROM rtree_<t>_geom WHERE id IN (OLD.<i>, NEW.<i>);
END)"},
    {"_delete", R"(CREATE TRIGGER rtree_<t>_geom_delete AFTER DELETE ON <t>
  WHEN OLD.geom NOT NULL
BEGIN
  DELETE FROM rtree_<t>_geom WHERE id = OLD.<i>;
END)"},
};

void replace_all(std::string& text, std::string_view mark, std::string_view by) {
  for (std::size_t at = 0; (at = text.find(mark, at)) != std::string::npos; at += by.size())
    text.replace(at, mark.size(), by);
}

std::vector<SchemaObject> index_of(const Layer& layer, std::int64_t version) {
  std::vector<SchemaObject> objects;
  objects.reserve(std::size(kIndexParts));
  for (const IndexPart& part : kIndexParts) {
    std::string sql(part.sql);
    replace_all(sql, "<e>", version < 4 ? kAnyUpdate : kUpdateOfKey);
    replace_all(sql, "<t>", layer.table);
    replace_all(sql, "<i>", layer.key);
    objects.push_back({fmt::format("rtree_{}_geom{}", layer.table, part.suffix), std::move(sql)});
  }
  return objects;
}

void insert_reference_systems(const Connection& connection) {
  Statement insert =
      connection.prepare("INSERT INTO gpkg_spatial_ref_sys VALUES (?1, ?2, ?3, ?4, ?5, ?6)");
  const auto add = [&](std::string_view name, std::int64_t id, std::string_view organization,
                       std::string_view definition, std::string_view description) {
    insert.bind(name, id, organization, id, definition, description).run();
  };
  add("Undefined Cartesian SRS", kCartesian, "NONE", "undefined",
      "undefined Cartesian coordinate reference system");
  add("Undefined geographic SRS", 0, "NONE", "undefined",
      "undefined geographic coordinate reference system");
  add("WGS 84 geodetic", 4326, "EPSG", kWgs84,
      "longitude/latitude coordinates in decimal degrees on the WGS 84 spheroid");
}

void insert_layers(const Connection& connection) {
  Statement contents = connection.prepare(
      "INSERT INTO gpkg_contents (table_name, data_type, identifier, description, srs_id) "
      "VALUES (?1, ?2, ?1, ?3, ?4)");
  Statement columns =
      connection.prepare("INSERT INTO gpkg_geometry_columns VALUES (?1, 'geom', ?2, ?3, 0, 0)");
  Statement extensions =
      connection.prepare("INSERT INTO gpkg_extensions VALUES (?1, ?2, ?3, ?4, ?5)");
  const std::int64_t frame = kCartesian;

  for (const Layer& layer : kLayers) {
    contents.bind(layer.table, std::string_view("features"), layer.text, frame).run();
    columns.bind(layer.table, layer.geometry, frame).run();
    extensions
        .bind(layer.table, std::string_view("geom"), std::string_view("gpkg_rtree_index"),
              std::string_view("http://www.geopackage.org/spec120/#extension_rtree"),
              std::string_view("write-only"))
        .run();
  }

  contents
      .bind(std::string_view("understory_maps"), std::string_view("attributes"),
            std::string_view("The maps: where each comes from, and its checksum"), std::nullopt)
      .run();
  for (const std::string_view table : {"understory_meta", "understory_history"}) {
    extensions
        .bind(table, std::nullopt, std::string_view("understory_map"),
              std::string_view("Understory, docs/decisions/090-map-file.md"),
              std::string_view("read-write"))
        .run();
  }
}

void state_version(const Connection& connection) {
  connection.prepare("INSERT OR REPLACE INTO understory_meta VALUES ('schema_version', ?1)")
      .bind(std::string_view(std::to_string(kSchemaVersion)))
      .run();
  state_program(connection);
}

/// Replaces the triggers of the layers' indexes.
void renew_triggers(const Connection& connection) {
  for (const SchemaObject& object : schema_objects()) {
    if (!object.sql.starts_with("CREATE TRIGGER")) continue;
    connection.execute("DROP TRIGGER IF EXISTS " + object.name);
    connection.execute(object.sql);
  }
}

[[noreturn]] void refuse_file(const Connection& connection, Fault fault, const std::string& why) {
  throw MapFileError(fault, fmt::format("{}: {}", connection.file().string(), why));
}

void verify_version(const Connection& connection) {
  const std::string version =
      connection.text("SELECT value FROM understory_meta WHERE key = 'schema_version'");
  for (std::int64_t known = kOldestSchemaVersion; known <= kSchemaVersion; ++known) {
    if (version == std::to_string(known)) return;
  }

  const bool is_newer = version.size() <= 9 && !version.empty() &&
                        version.find_first_not_of("0123456789") == std::string::npos &&
                        std::stoll(version) > kSchemaVersion;
  refuse_file(connection, Fault::kOtherVersion,
              fmt::format("its schema has the version '{}', this program reads {} to {}{}",
                          version.substr(0, 20), kOldestSchemaVersion, kSchemaVersion,
                          is_newer ? ": a newer Understory wrote it" : ""));
}

}  // namespace

std::vector<SchemaObject> schema_objects(std::int64_t version) {
  std::vector<SchemaObject> objects;
  const auto table = [&](std::string_view name, std::string_view sql) {
    objects.push_back({std::string(name), std::string(sql)});
  };
  table("gpkg_spatial_ref_sys", kSpatialRefSys);
  table("gpkg_contents", kContents);
  table("gpkg_geometry_columns", kGeometryColumns);
  table("gpkg_extensions", kExtensions);

  table("understory_meta", kMeta);
  table("understory_maps", kMaps);
  table("understory_history", kHistory);
  table("landmarks", kLandmarks);
  table("trajectory", kTrajectory);
  table("submap_borders", kSubmapBorders);
  table("loop_closures", kLoopClosures);

  for (const Layer& layer : kLayers) {
    for (SchemaObject& object : index_of(layer, version)) objects.push_back(std::move(object));
  }
  if (version < 2) return objects;
  for (SchemaObject& object : submap_objects()) objects.push_back(std::move(object));
  if (version < 3) return objects;
  for (SchemaObject& object : existence_objects()) objects.push_back(std::move(object));
  if (version < 4) return objects;
  for (SchemaObject& object : reference_objects()) objects.push_back(std::move(object));
  return objects;
}

bool is_standard_trigger(std::string_view name, std::string_view sql) {
  for (const Layer& layer : kLayers) {
    for (const SchemaObject& object : index_of(layer, kOldestSchemaVersion))
      if (object.name == name && object.sql.starts_with("CREATE TRIGGER"))
        return is_same_sql(object.sql, sql);
  }
  return false;
}

void create_schema(const Connection& connection) {
  connection.trust_schema(true);
  connection.execute(fmt::format("PRAGMA application_id = {}; PRAGMA user_version = {}",
                                 kGeoPackage, kGeoPackageVersion));
  for (const SchemaObject& object : schema_objects()) connection.execute(object.sql);
  insert_reference_systems(connection);
  insert_layers(connection);
  register_submap_tables(connection);
  register_existence_tables(connection);
  register_reference_table(connection);
  state_version(connection);
}

std::int64_t schema_version(const Connection& connection) {
  return std::stoll(
      connection.text("SELECT value FROM understory_meta WHERE key = 'schema_version'"));
}

void state_program(const Connection& connection) {
  connection.prepare("INSERT OR REPLACE INTO understory_meta VALUES ('program_version', ?1)")
      .bind(std::string_view(model::program_version()))
      .run();
}

std::string program_of(const Connection& connection) {
  Statement row =
      connection.prepare("SELECT value FROM understory_meta WHERE key = 'program_version'");
  return row.step() ? row.text(0) : std::string();
}

void upgrade_schema(const Connection& connection) {
  const std::int64_t version = schema_version(connection);
  if (version == kSchemaVersion) return;
  Transaction transaction(connection);
  if (version < 2) {
    for (const SchemaObject& object : submap_objects()) connection.execute(object.sql);
    register_submap_tables(connection);
  }
  if (version < 3) {
    for (const SchemaObject& object : existence_objects()) connection.execute(object.sql);
    register_existence_tables(connection);
  }
  renew_triggers(connection);
  for (const SchemaObject& object : reference_objects()) connection.execute(object.sql);
  register_reference_table(connection);
  state_version(connection);
  transaction.commit();
}

void verify_schema(const Connection& connection) {
  if (connection.number("PRAGMA application_id") != kGeoPackage)
    refuse_file(connection, Fault::kForeign, "no map file: it is no GeoPackage");
  const bool is_ours =
      connection.number(
          "SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name = 'understory_meta'") >
      0;
  if (!is_ours)
    refuse_file(connection, Fault::kForeign, "a GeoPackage, but no map file of Understory");

  verify_version(connection);
  Statement find = connection.prepare("SELECT count(*) FROM sqlite_schema WHERE name = ?1");
  for (const SchemaObject& object : schema_objects(schema_version(connection))) {
    find.bind(std::string_view(object.name)).step();
    if (find.integer(0) == 0) connection.damaged(fmt::format("{} is missing", object.name));
  }
}

void refresh_contents(const Connection& connection, model::Utime utime) {
  refresh_registration(connection);
  Statement stamp = connection.prepare(
      "UPDATE gpkg_contents SET last_change = strftime('%Y-%m-%dT%H:%M:%fZ', ?1, 'unixepoch')");
  stamp.bind(1e-6 * static_cast<double>(utime)).run();
  for (const Layer& layer : kLayers) {
    connection.execute(
        fmt::format("UPDATE gpkg_contents SET (min_x, min_y, max_x, max_y) = "
                    "(SELECT min(ST_MinX(geom)), min(ST_MinY(geom)), max(ST_MaxX(geom)), "
                    "max(ST_MaxY(geom)) FROM {0}) WHERE table_name = '{0}'",
                    layer.table));
  }
}

}  // namespace understory::map_file
