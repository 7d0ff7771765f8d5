// The checksums of map_rows.hpp.
#include <fmt/format.h>
#include <sqlite3.h>

#include <array>

#include "common/map_file/digest.hpp"
#include "common/map_file/existence_tables.hpp"
#include "common/map_file/map_rows.hpp"

namespace understory::map_file {
namespace {

struct ContentQuery {
  std::string_view table;
  std::string_view sql;
};

/// Columns are listed by name, so columns added by other programs are not included.
constexpr std::array<ContentQuery, 5> kContentQueries{{
    {"understory_maps",
     "SELECT map_id, name, created_utime, origin FROM understory_maps WHERE map_id = ?1"},
    {"landmarks",
     "SELECT landmark_id, geom, submap_id, covariance_xx_m2, covariance_xy_m2, covariance_yy_m2, "
     "diameter_m, kind, times_seen, existence FROM landmarks WHERE map_id = ?1 "
     "ORDER BY landmark_id"},
    {"trajectory",
     "SELECT fid, geom, sequence, utime, heading_rad, covariance_xx_m2, covariance_xy_m2, "
     "covariance_yy_m2, covariance_xt_m_rad, covariance_yt_m_rad, covariance_tt_rad2 "
     "FROM trajectory WHERE map_id = ?1 ORDER BY fid"},
    {"submap_borders",
     "SELECT fid, geom, submap_id FROM submap_borders WHERE map_id = ?1 ORDER BY fid"},
    {"loop_closures",
     "SELECT fid, geom, from_sequence, to_sequence FROM loop_closures WHERE map_id = ?1 "
     "ORDER BY fid"},
}};
/// A table without rows of the map is not included, so sums from before these tables stay valid.
constexpr std::array<ContentQuery, 2> kExistenceQueries{{
    {"existence_models", "SELECT utime, model FROM existence_models WHERE map_id = ?1"},
    {"existence_states",
     "SELECT landmark_id, utime, probability, in_use, state FROM existence_states "
     "WHERE map_id = ?1 ORDER BY landmark_id"},
}};

void add_column(const Statement& row, int column, Digest& digest) {
  switch (sqlite3_column_type(row.handle(), column)) {
    case SQLITE_INTEGER:
      return digest.add(row.integer(column));
    case SQLITE_FLOAT:
      return digest.add(row.real(column));
    case SQLITE_TEXT:
      return digest.add(row.text(column));
    case SQLITE_BLOB:
      return digest.add(row.blob(column));
    default:
      return digest.add_null();
  }
}

void add_row(const Statement& row, Digest& digest) {
  const int columns = sqlite3_column_count(row.handle());
  for (int column = 0; column < columns; ++column) add_column(row, column, digest);
}

void add_existence(const Connection& connection, std::uint32_t map_id, Digest& digest) {
  if (!has_existence_tables(connection)) return;
  for (const ContentQuery& query : kExistenceQueries) {
    Statement row = connection.prepare(query.sql);
    row.bind(std::int64_t{map_id});
    for (bool is_first = true; row.step(); is_first = false) {
      if (is_first) digest.add(query.table);
      add_row(row, digest);
    }
  }
}

}  // namespace

std::string checksum_of(const Connection& connection, std::uint32_t map_id) {
  Digest digest;
  for (const ContentQuery& query : kContentQueries) {
    Statement row = connection.prepare(query.sql);
    row.bind(std::int64_t{map_id});
    digest.add(query.table);
    while (row.step()) add_row(row, digest);
  }
  add_existence(connection, map_id, digest);
  return digest.take();
}

std::string stated_checksum(const Connection& connection, std::uint32_t map_id) {
  Statement row = connection.prepare("SELECT checksum FROM understory_maps WHERE map_id = ?1");
  return row.bind(std::int64_t{map_id}).step() ? row.text(0) : std::string();
}

void state_checksum(const Connection& connection, std::uint32_t map_id) {
  const std::string checksum = checksum_of(connection, map_id);
  connection.prepare("UPDATE understory_maps SET checksum = ?2 WHERE map_id = ?1")
      .bind(std::int64_t{map_id}, std::string_view(checksum))
      .run();
}

void verify_checksum(const Connection& connection, std::uint32_t map_id) {
  if (checksum_of(connection, map_id) == stated_checksum(connection, map_id)) return;
  throw MapFileError(
      Fault::kDamaged,
      fmt::format(
          "{}: map {} is not what its checksum says: damaged, or changed by another program",
          connection.file().string(), map_id));
}

}  // namespace understory::map_file
