#include "common/map_file/check.hpp"

#include <fmt/format.h>

#include <functional>

#include "common/map_file/geometry_blob.hpp"
#include "common/map_file/history.hpp"
#include "common/map_file/map_rows.hpp"
#include "common/map_file/reference_rows.hpp"
#include "common/map_file/schema.hpp"
#include "common/map_file/schema_guard.hpp"
#include "common/map_file/sql_text.hpp"
#include "common/map_file/submap_rows.hpp"

namespace understory::map_file {
namespace {

using Findings = std::vector<std::string>;

/// Checks pages, indexes and keys by SQLite.
void check_database(const Connection& connection, Findings& findings) {
  Statement pages = connection.prepare("PRAGMA integrity_check");
  while (pages.step()) {
    const std::string line = pages.text(0);
    if (line != "ok") findings.push_back("database: " + line);
  }

  Statement keys = connection.prepare("PRAGMA foreign_key_check");
  while (keys.step())
    findings.push_back(fmt::format("{}: a row refers to a row of {} that is not there",
                                   keys.text(0), keys.text(2)));
}

/// Finds definitions that differ from this version's, even if they are harmless.
void check_schema(const Connection& connection, Findings& findings) {
  Statement find = connection.prepare("SELECT sql FROM sqlite_schema WHERE name = ?1");
  for (const SchemaObject& object : schema_objects(schema_version(connection))) {
    const bool is_there = find.bind(std::string_view(object.name)).step();
    const bool is_as_made = is_there && (is_same_sql(object.sql, find.text(0)) ||
                                         is_standard_trigger(object.name, find.text(0)));
    if (!is_as_made)
      findings.push_back(fmt::format("{}: {}", object.name,
                                     is_there ? "its definition was changed" : "is missing"));
  }
}

/// Checks the rows by which other programs find the layers.
void check_registration(const Connection& connection, Findings& findings) {
  if (connection.number(
          "SELECT count(*) FROM gpkg_spatial_ref_sys WHERE srs_id IN (-1, 0, 4326)") != 3)
    findings.emplace_back("gpkg_spatial_ref_sys: a required row is missing");

  Statement rows = connection.prepare(
      "SELECT (SELECT count(*) FROM gpkg_contents WHERE table_name = ?1 AND "
      "data_type = 'features') + "
      "(SELECT count(*) FROM gpkg_geometry_columns WHERE table_name = ?1 AND "
      "column_name = 'geom' AND geometry_type_name = ?2 AND z = 0 AND m = 0) + "
      "(SELECT count(*) FROM gpkg_extensions WHERE table_name = ?1 AND column_name = 'geom' AND "
      "extension_name = 'gpkg_rtree_index')");
  for (const Layer& layer : kLayers) {
    rows.bind(layer.table, layer.geometry).step();
    if (rows.integer(0) != 3)
      findings.push_back(fmt::format("{}: is not registered as a layer", layer.table));
  }
  if (!is_registered(connection))
    findings.emplace_back(
        "gpkg_spatial_ref_sys: the layers' reference system is not what the maps state");
}

/// Checks that the rectangle in gpkg_contents contains all features.
void check_extent(const Connection& connection, const Layer& layer, Findings& findings) {
  const std::int64_t outside = connection.number(fmt::format(
      "SELECT count(*) FROM {0}, gpkg_contents AS c WHERE c.table_name = '{0}' AND NOT coalesce("
      "ST_MinX(geom) >= c.min_x AND ST_MaxX(geom) <= c.max_x AND "
      "ST_MinY(geom) >= c.min_y AND ST_MaxY(geom) <= c.max_y, 0)",
      layer.table));
  if (outside > 0)
    findings.push_back(
        fmt::format("{}: {} features lie outside of the extent that gpkg_contents "
                    "states",
                    layer.table, outside));
}

/// Sides in the index are rounded outwards to 32 bits.
std::string fits_sql(std::string_view side, std::string_view function, std::string_view sign) {
  return fmt::format("{2}(r.{0} - {1}(geom)) BETWEEN 0 AND 1e-6 * abs({1}(geom)) + 1e-30", side,
                     function, sign);
}

void check_index(const Connection& connection, const Layer& layer, Findings& findings) {
  const std::string structure =
      connection.text(fmt::format("SELECT rtreecheck('rtree_{}_geom')", layer.table));
  if (structure != "ok") findings.push_back(fmt::format("{}: index: {}", layer.table, structure));

  const std::int64_t wrong = connection.number(fmt::format(
      "SELECT count(*) FROM {0} LEFT JOIN rtree_{0}_geom AS r ON r.id = {1} WHERE NOT coalesce("
      "{2} AND {3} AND {4} AND {5}, 0)",
      layer.table, layer.key, fits_sql("minx", "ST_MinX", "-"), fits_sql("maxx", "ST_MaxX", "+"),
      fits_sql("miny", "ST_MinY", "-"), fits_sql("maxy", "ST_MaxY", "+")));
  const std::int64_t too_many = connection.number(fmt::format(
      "SELECT (SELECT count(*) FROM rtree_{0}_geom) - (SELECT count(*) FROM {0})", layer.table));
  if (wrong > 0 || too_many != 0)
    findings.push_back(
        fmt::format("{}: its index of places is not that of its features", layer.table));
}

void check_maps(const Connection& connection, Findings& findings) {
  for (const std::uint32_t id : map_ids(connection)) {
    if (checksum_of(connection, id) != stated_checksum(connection, id))
      findings.push_back(
          fmt::format("map {}: is not what its checksum says: damaged, or changed by another "
                      "program (then `map "
                      "accept` takes it over and `map revert` takes it back)",
                      id));
    try {
      select_map(connection, id);
    } catch (const MapFileError& error) {
      findings.emplace_back(error.what());
    }
  }
}

/// Finds maps that agree with their checksums but not with the history.
void check_against_history(const Connection& connection, Findings& findings) {
  const auto recorded = recorded_content(connection);
  if (select_reference(connection) != select_reference(*recorded))
    findings.emplace_back("understory_reference: is not what the history says");
  for (const std::uint32_t id : map_ids(*recorded)) {
    const std::string stated = stated_checksum(connection, id);
    if (stated.empty()) {
      findings.push_back(fmt::format("map {}: is gone, and no change says so", id));
    } else if (stated != checksum_of(*recorded, id) && stated == checksum_of(connection, id)) {
      findings.push_back(fmt::format("map {}: is not what the history says", id));
    }
  }
}

}  // namespace

Findings findings_in(const Connection& connection) {
  Findings findings;
  // Damage may end one part of the check; the others still run.
  const auto part = [&](const std::function<void()>& check) {
    try {
      check();
    } catch (const MapFileError& error) {
      findings.emplace_back(error.what());
    }
  };

  part([&] { check_database(connection, findings); });
  part([&] { check_schema(connection, findings); });
  part([&] {
    for (const std::string& one : foreign_sql_in(connection)) findings.push_back(one);
  });
  part([&] { check_registration(connection, findings); });
  for (const Layer& layer : kLayers) {
    part([&] { check_extent(connection, layer, findings); });
    part([&] { check_index(connection, layer, findings); });
  }

  part([&] { check_maps(connection, findings); });
  part([&] {
    if (schema_version(connection) < 2) return;
    const Findings faults = faults_of_submaps(connection);
    findings.insert(findings.end(), faults.begin(), faults.end());
  });
  part([&] {
    const Findings faults = faults_of_history(connection);
    findings.insert(findings.end(), faults.begin(), faults.end());
    if (faults.empty()) check_against_history(connection, findings);
  });
  return findings;
}

}  // namespace understory::map_file
