#include "common/map_file/existence_rows.hpp"

#include <fmt/format.h>

#include "common/map_file/existence_tables.hpp"

namespace understory::map_file {
namespace {

Blob blob_of(const std::string& bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

std::string string_of(Blob bytes) { return {bytes.begin(), bytes.end()}; }

ExistenceRow existence_in(const Connection& connection, const Statement& row) {
  ExistenceRow one;
  one.existence.id = row.count(0);
  one.utime = row.integer(1);
  one.existence.probability = row.real(2);
  const std::int64_t in_use = row.integer(3);
  if (in_use != 0 && in_use != 1)
    connection.damaged(fmt::format("existence of landmark {}: in_use is {}, not 0 or 1",
                                   one.existence.id, in_use));
  one.existence.is_in_use = in_use == 1;
  one.state = string_of(row.blob(4));
  return one;
}

}  // namespace

void put_existence(const Connection& connection, std::uint32_t map_id,
                   const StoredExistence& existence) {
  connection
      .prepare(
          "INSERT INTO existence_models VALUES (?1, ?2, ?3) ON CONFLICT (map_id) DO UPDATE SET "
          "utime = excluded.utime, model = excluded.model "
          "WHERE excluded.utime >= existence_models.utime")
      .bind(std::int64_t{map_id}, std::int64_t{existence.utime}, blob_of(existence.learned))
      .run();

  Statement insert = connection.prepare(
      "INSERT INTO existence_states VALUES (?1, ?2, ?3, ?4, ?5, ?6) ON CONFLICT (landmark_id) DO "
      "UPDATE SET map_id = excluded.map_id, utime = excluded.utime, "
      "probability = excluded.probability, in_use = excluded.in_use, state = excluded.state "
      "WHERE excluded.utime >= existence_states.utime");
  for (const ExistenceRow& row : existence.landmarks) {
    insert
        .bind(static_cast<std::int64_t>(row.existence.id), std::int64_t{map_id},
              std::int64_t{row.utime}, row.existence.probability,
              std::int64_t{row.existence.is_in_use ? 1 : 0}, blob_of(row.state))
        .run();
  }
}

std::optional<StoredExistence> select_existence(const Connection& connection,
                                                std::uint32_t map_id) {
  if (!has_existence_tables(connection)) return std::nullopt;
  StoredExistence existence;
  Statement learned =
      connection.prepare("SELECT utime, model FROM existence_models WHERE map_id = ?1");
  const bool has_learned = learned.bind(std::int64_t{map_id}).step();
  if (has_learned) {
    existence.utime = learned.integer(0);
    existence.learned = string_of(learned.blob(1));
  }

  Statement row = connection.prepare(
      "SELECT landmark_id, utime, probability, in_use, state FROM existence_states "
      "WHERE map_id = ?1 ORDER BY landmark_id");
  row.bind(std::int64_t{map_id});
  while (row.step()) existence.landmarks.push_back(existence_in(connection, row));
  if (has_learned) return existence;
  if (!existence.landmarks.empty())
    connection.damaged(fmt::format("map {}: states of existence without their model", map_id));
  return std::nullopt;
}

void delete_existence(const Connection& connection, std::uint32_t map_id) {
  for (const char* const table : {"existence_states", "existence_models"}) {
    connection.prepare(fmt::format("DELETE FROM {} WHERE map_id = ?1", table))
        .bind(std::int64_t{map_id})
        .run();
  }
}

ExistenceCounts count_existence(const Connection& connection, std::uint32_t map_id) {
  if (!has_existence_tables(connection)) return {};
  Statement row = connection.prepare(
      "SELECT count(*), count(CASE WHEN in_use = 0 THEN 1 END) FROM existence_states "
      "WHERE map_id = ?1");
  row.bind(std::int64_t{map_id}).step();
  return {row.count(0), row.count(1)};
}

void drop_lost_states(const Connection& connection) {
  connection.execute(
      "DELETE FROM existence_states WHERE landmark_id NOT IN (SELECT landmark_id FROM landmarks); "
      "DELETE FROM existence_models WHERE map_id NOT IN (SELECT map_id FROM understory_maps)");
}

void settle_existence(const Connection& connection) {
  drop_lost_states(connection);
  connection.execute(
      "UPDATE existence_states AS s SET map_id = l.map_id FROM landmarks AS l "
      "WHERE l.landmark_id = s.landmark_id AND l.map_id != s.map_id");
  // A map that received its first landmark with a state continues with the latest learned values.
  connection.execute(
      "INSERT OR IGNORE INTO existence_models "
      "SELECT DISTINCT s.map_id, m.utime, m.model FROM existence_states AS s, "
      "(SELECT utime, model FROM existence_models ORDER BY utime DESC, map_id DESC LIMIT 1) AS m");
  connection.execute(
      "UPDATE landmarks AS l SET existence = s.probability FROM existence_states AS s "
      "WHERE s.landmark_id = l.landmark_id AND l.existence IS NOT s.probability");
}

}  // namespace understory::map_file
