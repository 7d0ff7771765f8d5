#include "common/map_file/submap_rows.hpp"

#include <fmt/format.h>

#include "common/map_file/digest.hpp"
#include "common/map_file/submap_codec.hpp"
#include "common/map_file/submap_tables.hpp"

namespace understory::map_file {
namespace {

std::int64_t as_integer(std::uint64_t value) { return static_cast<std::int64_t>(value); }
std::int64_t map_of(const SubmapKey& key) { return std::int64_t{key.map_id}; }

/// A submap's columns of bytes.
struct SubmapBytes {
  Blob replaces;
  Blob border;
  Blob landmarks;
  Blob keyframes;
  Blob payload;
};

std::string digest_of(const SubmapKey& key, model::Utime utime, std::uint64_t content_hash,
                      const SubmapBytes& bytes) {
  Digest digest;
  digest.add(map_of(key));
  digest.add(as_integer(key.id));
  digest.add(std::int64_t{utime});
  digest.add(as_integer(content_hash));
  for (const Blob& blob :
       {bytes.replaces, bytes.border, bytes.landmarks, bytes.keyframes, bytes.payload})
    digest.add(blob);
  return digest.take();
}

constexpr std::string_view kSelectSubmap =
    "SELECT utime, content_hash, replaces, border, landmarks, keyframes, payload, checksum "
    "FROM understory_submaps WHERE map_id = ?1 AND submap_id = ?2 AND state != 'replaced'";

std::vector<Eigen::Vector2d> places_of(const model::Submap& submap) {
  std::vector<Eigen::Vector2d> places{Eigen::Vector2d::Zero()};
  for (const model::MapLandmark& one : submap.landmarks) places.push_back(one.position_m);
  for (const model::KeyframePose& one : submap.keyframes)
    places.push_back(one.map_T_vehicle.translation());
  return places;
}

template <class T>
T whole(const Connection& connection, const SubmapKey& key, std::optional<T> value) {
  if (!value)
    connection.damaged(fmt::format("submap {} of map {} cannot be read", key.id, key.map_id));
  return *std::move(value);
}

PlacedSubmap placed_in(const Connection& connection, const Statement& row) {
  const std::int64_t map_id = row.integer(0);
  if (map_id < 1 || map_id > kLastMapId)
    connection.damaged(fmt::format("{} is no map's number", map_id));
  return {{static_cast<std::uint32_t>(map_id), row.count(1)},
          geometry::SE2(row.real(2), row.real(3), row.real(4))};
}

}  // namespace

std::optional<SubmapState> state_of(const Connection& connection, const SubmapKey& key) {
  Statement row = connection.prepare(
      "SELECT content_hash, state FROM understory_submaps WHERE map_id = ?1 AND submap_id = ?2");
  if (!row.bind(map_of(key), as_integer(key.id)).step()) return std::nullopt;
  return SubmapState{static_cast<std::uint64_t>(row.integer(0)), row.text(1)};
}

void insert_submap(const Connection& connection, const model::Submap& submap,
                   const geometry::SE2& map_T_submap) {
  const SubmapKey key{submap.map_id, submap.id};
  const auto replaces = id_bytes(submap.replaced);
  const auto border = border_bytes(border_around(places_of(submap)));
  const auto landmarks = landmark_bytes(submap.landmarks);
  const auto keyframes = keyframe_bytes(submap.keyframes);
  const auto payload = packed(submap.payload);
  const SubmapBytes bytes{replaces, border, landmarks, keyframes, payload};
  const std::string checksum = digest_of(key, submap.utime, submap.content_hash, bytes);

  connection
      .prepare(
          "INSERT INTO understory_submaps (map_id, submap_id, utime, content_hash, state, "
          "replaces, border, landmarks, keyframes, payload, checksum) "
          "VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11)")
      .bind(map_of(key), as_integer(key.id), std::int64_t{submap.utime},
            as_integer(submap.content_hash), kAway, bytes.replaces, bytes.border, bytes.landmarks,
            bytes.keyframes, bytes.payload, std::string_view(checksum))
      .run();
  connection
      .prepare(
          "INSERT INTO understory_submap_poses (map_id, submap_id, version, x_m, y_m, "
          "heading_rad, is_drawn) VALUES (?1, ?2, 0, ?3, ?4, ?5, 1)")
      .bind(map_of(key), as_integer(key.id), map_T_submap.x(), map_T_submap.y(),
            map_T_submap.theta())
      .run();
}

std::optional<model::Submap> select_submap(const Connection& connection, const SubmapKey& key) {
  Statement row = connection.prepare(kSelectSubmap);
  if (!row.bind(map_of(key), as_integer(key.id)).step()) return std::nullopt;

  model::Submap submap;
  submap.utime = row.integer(0);
  submap.map_id = key.map_id;
  submap.id = key.id;
  submap.content_hash = static_cast<std::uint64_t>(row.integer(1));
  const SubmapBytes bytes{row.blob(2), row.blob(3), row.blob(4), row.blob(5), row.blob(6)};
  if (digest_of(key, submap.utime, submap.content_hash, bytes) != row.text(7))
    connection.damaged(
        fmt::format("submap {} of map {} is not what was written", key.id, key.map_id));

  submap.replaced = whole(connection, key, ids_in(bytes.replaces));
  submap.landmarks = whole(connection, key, landmarks_in(bytes.landmarks));
  submap.keyframes = whole(connection, key, keyframes_in(bytes.keyframes));
  submap.payload = whole(connection, key, unpacked(bytes.payload));
  submap.map_T_submap = whole(connection, key, pose_of(connection, key));
  return submap;
}

std::vector<Eigen::Vector2d> select_border(const Connection& connection, const SubmapKey& key) {
  Statement row = connection.prepare(
      "SELECT border FROM understory_submaps WHERE map_id = ?1 AND submap_id = ?2");
  std::optional<std::vector<Eigen::Vector2d>> border;
  if (row.bind(map_of(key), as_integer(key.id)).step()) border = border_in(row.blob(0));
  return whole(connection, key, std::move(border));
}

void replace_submap(const Connection& connection, const SubmapKey& key) {
  connection
      .prepare(
          "UPDATE understory_submaps SET state = ?3, replaces = x'', border = x'', "
          "landmarks = x'', keyframes = x'', payload = x'', checksum = '' "
          "WHERE map_id = ?1 AND submap_id = ?2")
      .bind(map_of(key), as_integer(key.id), kReplaced)
      .run();
  connection.prepare("DELETE FROM understory_submap_poses WHERE map_id = ?1 AND submap_id = ?2")
      .bind(map_of(key), as_integer(key.id))
      .run();
}

void set_state(const Connection& connection, const SubmapKey& key, std::string_view state) {
  connection
      .prepare("UPDATE understory_submaps SET state = ?3 WHERE map_id = ?1 AND submap_id = ?2")
      .bind(map_of(key), as_integer(key.id), state)
      .run();
}

std::optional<geometry::SE2> pose_of(const Connection& connection, const SubmapKey& key) {
  Statement row = connection.prepare(
      "SELECT x_m, y_m, heading_rad FROM understory_submap_poses "
      "WHERE map_id = ?1 AND submap_id = ?2");
  if (!row.bind(map_of(key), as_integer(key.id)).step()) return std::nullopt;
  return geometry::SE2(row.real(0), row.real(1), row.real(2));
}

std::vector<PlacedSubmap> update_poses(const Connection& connection,
                                       const model::MapCorrection& correction) {
  std::vector<PlacedSubmap> moved;
  Statement update = connection.prepare(
      "UPDATE understory_submap_poses SET version = ?3, x_m = ?4, y_m = ?5, heading_rad = ?6, "
      "is_drawn = 0 WHERE map_id = ?1 AND submap_id = ?2 AND version < ?3 AND "
      "(x_m != ?4 OR y_m != ?5 OR heading_rad != ?6) RETURNING submap_id");
  for (const model::SubmapPose& one : correction.submaps) {
    const geometry::SE2& pose = one.map_T_submap;
    const bool has_moved =
        update
            .bind(std::int64_t{correction.map_id}, as_integer(one.id),
                  as_integer(correction.version), pose.x(), pose.y(), pose.theta())
            .step();
    if (has_moved) moved.push_back({{correction.map_id, one.id}, pose});
  }
  return moved;
}

void place_submap(const Connection& connection, const PlacedSubmap& placed) {
  const geometry::SE2& pose = placed.map_T_submap;
  Statement update = connection.prepare(
      "UPDATE understory_submap_poses SET x_m = ?3, y_m = ?4, heading_rad = ?5 "
      "WHERE map_id = ?1 AND submap_id = ?2 RETURNING submap_id");
  const bool is_there =
      update.bind(map_of(placed.key), as_integer(placed.key.id), pose.x(), pose.y(), pose.theta())
          .step();
  if (!is_there)
    throw MapFileError(Fault::kRefused,
                       fmt::format("{}: map {} has no submap {}", connection.file().string(),
                                   placed.key.map_id, placed.key.id));
}

std::vector<PlacedSubmap> to_draw(const Connection& connection, std::size_t most) {
  std::vector<PlacedSubmap> result;
  Statement row = connection.prepare(
      "SELECT map_id, submap_id, x_m, y_m, heading_rad FROM understory_submap_poses "
      "WHERE is_drawn = 0 ORDER BY map_id, submap_id LIMIT ?1");
  row.bind(as_integer(most));
  while (row.step()) result.push_back(placed_in(connection, row));
  return result;
}

void set_drawn(const Connection& connection, const SubmapKey& key) {
  connection
      .prepare(
          "UPDATE understory_submap_poses SET is_drawn = 1 "
          "WHERE map_id = ?1 AND submap_id = ?2")
      .bind(map_of(key), as_integer(key.id))
      .run();
}

std::vector<SubmapKey> stored_submaps(const Connection& connection) {
  std::vector<SubmapKey> keys;
  Statement row = connection.prepare(
      "SELECT map_id, submap_id, 0.0, 0.0, 0.0 FROM understory_submaps "
      "WHERE state != 'replaced' ORDER BY map_id, submap_id");
  while (row.step()) keys.push_back(placed_in(connection, row).key);
  return keys;
}

std::vector<std::string> faults_of_submaps(const Connection& connection) {
  std::vector<std::string> faults;
  for (const SubmapKey& key : stored_submaps(connection)) {
    try {
      const auto submap = select_submap(connection, key);
      select_border(connection, key);
      if (model::fnv1a(submap->payload) != submap->content_hash)
        faults.push_back(
            fmt::format("submap {} of map {}: its hash is not its content's", key.id, key.map_id));
    } catch (const MapFileError& error) {
      faults.emplace_back(error.what());
    }
  }
  const std::int64_t lonely = connection.number(
      "SELECT count(*) FROM understory_submap_poses AS p LEFT JOIN understory_submaps AS s "
      "ON s.map_id = p.map_id AND s.submap_id = p.submap_id AND s.state != 'replaced' "
      "WHERE s.map_id IS NULL");
  if (lonely > 0) faults.push_back(fmt::format("submaps: {} poses are of no submap", lonely));
  return faults;
}

}  // namespace understory::map_file
