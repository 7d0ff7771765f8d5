#include "common/map_file/map_rows.hpp"

#include <fmt/format.h>

#include "common/map_file/existence_rows.hpp"
#include "common/map_file/geometry_blob.hpp"
#include "common/map_file/layer_rows.hpp"
#include "common/map_file/schema.hpp"

namespace understory::map_file {
namespace {

/// Number of the i-th row of a map in a layer without numbers of its own.
std::int64_t row_number(std::uint32_t map_id, std::size_t i) {
  return static_cast<std::int64_t>(landmark_id(map_id, i + 1));
}

/// Writes rows in order.
template <class Rows, class Values>
void insert_all(Rows rows, std::uint32_t map_id, const Values& values) {
  for (std::size_t i = 0; i < values.size(); ++i)
    rows.put(row_number(map_id, i), map_id, values[i]);
}

/// Reads a column with a geometry of this kind and at least `least` points.
std::vector<Eigen::Vector2d> points_in(const Connection& connection, const Statement& row,
                                       int column, GeometryKind kind, std::size_t least) {
  auto geometry = geometry_of(row.blob(column));
  if (!geometry || geometry->kind != kind || geometry->points_m.size() < least)
    connection.damaged("a geometry cannot be read");
  return std::move(geometry->points_m);
}

/// The upper triangle of a covariance, row by row from `column` on; zero where it is NULL.
template <int N>
Eigen::Matrix<double, N, N> covariance_in(const Statement& row, const std::array<int, 6>& columns) {
  Eigen::Matrix<double, N, N> covariance = Eigen::Matrix<double, N, N>::Zero();
  if (row.is_null(columns[0])) return covariance;
  int next = 0;
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j <= i; ++j)
      covariance(i, j) = covariance(j, i) = row.real(columns[static_cast<std::size_t>(next++)]);
  }
  return covariance;
}

model::LandmarkKind kind_in(const Connection& connection, const Statement& row, int column) {
  const std::string kind = row.text(column);
  if (kind != kTrunkText && kind != kCornerText)
    connection.damaged("a landmark is of no known kind");
  return kind == kTrunkText ? model::LandmarkKind::kTrunk : model::LandmarkKind::kCorner;
}

StoredLandmark landmark_in(const Connection& connection, const Statement& row) {
  StoredLandmark one;
  model::MapLandmark& landmark = one.landmark;
  landmark.id = row.count(0);
  landmark.position_m = points_in(connection, row, 1, GeometryKind::kPoint, 1).front();
  landmark.covariance_m2 = covariance_in<2>(row, {3, 4, 5});
  if (!row.is_null(6)) landmark.radius_m = 0.5 * row.real(6);
  landmark.kind = kind_in(connection, row, 7);
  const std::uint64_t seen = row.count(8);
  if (seen > std::numeric_limits<std::uint32_t>::max()) connection.damaged("times_seen is none");
  landmark.observation_count = static_cast<std::uint32_t>(seen);
  if (!row.is_null(2)) one.submap_id = row.count(2);
  if (!row.is_null(9)) one.existence = row.real(9);
  return one;
}

void select_landmarks(const Connection& connection, StoredMap& map) {
  Statement row = connection.prepare(
      "SELECT landmark_id, geom, submap_id, covariance_xx_m2, covariance_xy_m2, covariance_yy_m2, "
      "diameter_m, kind, times_seen, existence FROM landmarks WHERE map_id = ?1 "
      "ORDER BY landmark_id");
  row.bind(std::int64_t{map.map_id});
  while (row.step()) map.landmarks.push_back(landmark_in(connection, row));
}

void select_keyframes(const Connection& connection, StoredMap& map) {
  Statement row = connection.prepare(
      "SELECT geom, sequence, utime, heading_rad, covariance_xx_m2, covariance_xy_m2, "
      "covariance_yy_m2, covariance_xt_m_rad, covariance_yt_m_rad, covariance_tt_rad2 "
      "FROM trajectory WHERE map_id = ?1 ORDER BY fid");
  row.bind(std::int64_t{map.map_id});
  while (row.step()) {
    model::KeyframePose pose;
    const auto place = points_in(connection, row, 0, GeometryKind::kPoint, 1).front();
    pose.keyframe_sequence = row.count(1);
    pose.utime = row.integer(2);
    pose.map_T_vehicle = geometry::SE2(place, row.real(3));
    pose.covariance = covariance_in<3>(row, {4, 5, 6, 7, 8, 9});
    map.keyframes.push_back(pose);
  }
}

void select_borders(const Connection& connection, StoredMap& map) {
  Statement row = connection.prepare(
      "SELECT geom, submap_id FROM submap_borders WHERE map_id = ?1 ORDER BY fid");
  row.bind(std::int64_t{map.map_id});
  while (row.step()) {
    map.submap_borders.push_back(
        {row.count(1), points_in(connection, row, 0, GeometryKind::kPolygon, 3)});
  }
}

void select_loops(const Connection& connection, StoredMap& map) {
  Statement row = connection.prepare(
      "SELECT geom, from_sequence, to_sequence FROM loop_closures WHERE map_id = ?1 ORDER BY fid");
  row.bind(std::int64_t{map.map_id});
  while (row.step()) {
    const auto ends = points_in(connection, row, 0, GeometryKind::kLine, 2);
    map.loop_closures.push_back({row.count(1), row.count(2), ends.front(), ends.back()});
  }
}

/// Refuses landmarks of other maps: a landmark is in only one map of a file.
void refuse_landmarks_of_others(const Connection& connection, const StoredMap& map) {
  Statement row = connection.prepare("SELECT map_id FROM landmarks WHERE landmark_id = ?1");
  for (const StoredLandmark& one : map.landmarks) {
    if (row.bind(static_cast<std::int64_t>(one.landmark.id)).step())
      throw MapFileError(
          Fault::kRefused,
          fmt::format("{}: map {} is not stored: its landmark {} is in map {} already",
                      connection.file().string(), map.map_id, one.landmark.id, row.integer(0)));
  }
}

}  // namespace

void delete_map(const Connection& connection, std::uint32_t map_id) {
  delete_existence(connection, map_id);
  for (const Layer& layer : kLayers) {
    connection.prepare(fmt::format("DELETE FROM {} WHERE map_id = ?1", layer.table))
        .bind(std::int64_t{map_id})
        .run();
  }
  connection.prepare("DELETE FROM understory_maps WHERE map_id = ?1")
      .bind(std::int64_t{map_id})
      .run();
}

void insert_map(const Connection& connection, const StoredMap& map) {
  const std::string fault = fault_of(map);
  if (!fault.empty())
    throw MapFileError(Fault::kRefused, fmt::format("{}: map {} is not stored: {}",
                                                    connection.file().string(), map.map_id, fault));

  connection
      .prepare(
          "INSERT INTO understory_maps (map_id, name, created_utime, origin, checksum) VALUES (?1, "
          "?2, ?3, ?4, '')")
      .bind(std::int64_t{map.map_id}, std::string_view(map.name), std::int64_t{map.created_utime},
            std::string_view(map.origin))
      .run();
  refuse_landmarks_of_others(connection, map);
  LandmarkRows landmarks(connection, SameLandmark::kRefused);
  for (const StoredLandmark& one : map.landmarks) landmarks.put(map.map_id, one);
  insert_all(KeyframeRows(connection), map.map_id, map.keyframes);
  insert_all(BorderRows(connection), map.map_id, map.submap_borders);
  insert_all(LoopRows(connection), map.map_id, map.loop_closures);
  if (map.existence) put_existence(connection, map.map_id, *map.existence);

  state_checksum(connection, map.map_id);
}

StoredMap select_map(const Connection& connection, std::uint32_t map_id) {
  Statement row = connection.prepare(
      "SELECT name, created_utime, origin FROM understory_maps WHERE map_id = ?1");
  if (!row.bind(std::int64_t{map_id}).step())
    throw MapFileError(Fault::kRefused,
                       fmt::format("{}: has no map {}", connection.file().string(), map_id));
  StoredMap map{map_id, row.text(0), row.integer(1), row.text(2), {}, {}, {}, {}, {}};

  select_landmarks(connection, map);
  select_keyframes(connection, map);
  select_borders(connection, map);
  select_loops(connection, map);
  map.existence = select_existence(connection, map_id);
  const std::string fault = fault_of(map);
  if (!fault.empty()) connection.damaged(fmt::format("map {}: {}", map_id, fault));
  return map;
}

std::vector<std::uint32_t> map_ids(const Connection& connection) {
  std::vector<std::uint32_t> ids;
  Statement row = connection.prepare("SELECT map_id FROM understory_maps ORDER BY map_id");
  while (row.step()) {
    const std::int64_t id = row.integer(0);
    if (id < 1 || id > kLastMapId) connection.damaged(fmt::format("{} is no map's number", id));
    ids.push_back(static_cast<std::uint32_t>(id));
  }
  return ids;
}

}  // namespace understory::map_file
