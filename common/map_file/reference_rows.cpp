#include "common/map_file/reference_rows.hpp"

#include <fmt/format.h>

#include "common/map_file/geometry_blob.hpp"

namespace understory::map_file {
namespace {

constexpr std::string_view kReferenceTable = "understory_reference";
constexpr std::string_view kReference = R"(CREATE TABLE understory_reference (
  reference_id INTEGER NOT NULL PRIMARY KEY,
  system TEXT NOT NULL,
  latitude_deg DOUBLE NOT NULL,
  longitude_deg DOUBLE NOT NULL,
  rotation_rad DOUBLE NOT NULL,
  definition TEXT NOT NULL
))";

bool has_reference_table(const Connection& connection) {
  Statement find = connection.prepare("SELECT 1 FROM sqlite_schema WHERE name = ?1");
  return find.bind(kReferenceTable).step();
}

/// Keeps the coordinates and changes the number of the reference system.
void renumber_layer(const Connection& connection, const Layer& layer, std::int32_t srs_id) {
  std::vector<std::int64_t> keys;
  Statement row = connection.prepare(fmt::format("SELECT {} FROM {}", layer.key, layer.table));
  while (row.step()) keys.push_back(row.integer(0));

  Statement found =
      connection.prepare(fmt::format("SELECT geom FROM {} WHERE {} = ?1", layer.table, layer.key));
  Statement update = connection.prepare(
      fmt::format("UPDATE {} SET geom = ?2 WHERE {} = ?1", layer.table, layer.key));
  for (const std::int64_t key : keys) {
    std::optional<Geometry> geometry;
    if (found.bind(key).step()) geometry = geometry_of(found.blob(0));
    if (!geometry) connection.damaged("a geometry cannot be read");
    const auto bytes = geometry_blob(*geometry, srs_id);
    update.bind(key, Blob(bytes)).run();
  }
}

void put_system(const Connection& connection, const model::MapReference& reference) {
  const std::string text = fmt::format(
      "metres from latitude {:.8f}, longitude {:.8f}, turned {:.4f} rad from east; surveyed in {}",
      reference.latitude_deg, reference.longitude_deg, reference.rotation_rad, reference.system);
  connection
      .prepare(
          "INSERT INTO gpkg_spatial_ref_sys VALUES ('Understory map', ?1, 'UNDERSTORY', ?1, ?2, "
          "?3) ON CONFLICT (srs_id) DO UPDATE SET definition = ?2, description = ?3")
      .bind(std::int64_t{kMapFrame}, std::string_view(reference.definition), std::string_view(text))
      .run();
}

}  // namespace

std::vector<SchemaObject> reference_objects() {
  return {{std::string(kReferenceTable), std::string(kReference)}};
}

void register_reference_table(const Connection& connection) {
  connection.prepare("INSERT INTO gpkg_extensions VALUES (?1, NULL, ?2, ?3, ?4)")
      .bind(kReferenceTable, std::string_view("understory_map"),
            std::string_view("Understory, docs/decisions/168-maps-on-the-earth.md"),
            std::string_view("read-write"))
      .run();
}

std::optional<model::MapReference> select_reference(const Connection& connection) {
  if (!has_reference_table(connection)) return std::nullopt;
  Statement row = connection.prepare(
      "SELECT system, latitude_deg, longitude_deg, rotation_rad, definition "
      "FROM understory_reference");
  if (!row.step()) return std::nullopt;
  return model::MapReference{row.text(0), row.real(1), row.real(2), row.real(3), row.text(4)};
}

void put_reference(const Connection& connection, const model::MapReference& reference) {
  connection.prepare("INSERT OR REPLACE INTO understory_reference VALUES (1, ?1, ?2, ?3, ?4, ?5)")
      .bind(std::string_view(reference.system), reference.latitude_deg, reference.longitude_deg,
            reference.rotation_rad, std::string_view(reference.definition))
      .run();
  for (const Layer& layer : kLayers) renumber_layer(connection, layer, kMapFrame);
}

std::int32_t srs_of_layers(const Connection& connection) {
  return select_reference(connection) ? kMapFrame : kCartesian;
}

void refresh_registration(const Connection& connection) {
  if (is_registered(connection)) return;
  if (const auto reference = select_reference(connection)) put_system(connection, *reference);
  const std::int64_t srs_id = srs_of_layers(connection);
  for (const std::string_view table : {"gpkg_contents", "gpkg_geometry_columns"}) {
    Statement update =
        connection.prepare(fmt::format("UPDATE {} SET srs_id = ?2 WHERE table_name = ?1", table));
    for (const Layer& layer : kLayers) update.bind(layer.table, srs_id).run();
  }
}

bool is_registered(const Connection& connection) {
  const auto reference = select_reference(connection);
  const std::int64_t srs_id = reference ? kMapFrame : kCartesian;
  Statement count = connection.prepare(
      "SELECT (SELECT count(*) FROM gpkg_contents WHERE table_name = ?1 AND srs_id = ?2) + "
      "(SELECT count(*) FROM gpkg_geometry_columns WHERE table_name = ?1 AND srs_id = ?2)");
  for (const Layer& layer : kLayers) {
    count.bind(layer.table, srs_id).step();
    if (count.integer(0) != 2) return false;
  }
  if (!reference) return true;
  Statement system = connection.prepare(
      "SELECT 1 FROM gpkg_spatial_ref_sys WHERE srs_id = ?1 AND definition = ?2");
  return system.bind(srs_id, std::string_view(reference->definition)).step();
}

}  // namespace understory::map_file
