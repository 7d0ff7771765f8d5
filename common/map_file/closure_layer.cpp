// The loop closures of submap_layers.hpp.
#include <algorithm>
#include <optional>

#include "common/map_file/geometry_blob.hpp"
#include "common/map_file/layer_rows.hpp"
#include "common/map_file/submap_layers.hpp"

namespace understory::map_file {
namespace {

/// One end of a closure on the map.
struct ClosureEnd {
  Eigen::Vector2d place_m;
  /// Sequence of its keyframe, or of the keyframe nearest to the submap's origin.
  std::uint64_t sequence = 0;
};

std::optional<ClosureEnd> end_at_submap(const Connection& connection, const SubmapKey& key) {
  const auto submap = select_submap(connection, key);
  if (!submap) return std::nullopt;
  const auto distance = [](const model::KeyframePose& one) {
    return one.map_T_vehicle.translation().norm();
  };
  const auto nearest = std::ranges::min_element(submap->keyframes, {}, distance);
  const bool has_keyframe = nearest != submap->keyframes.end();
  return ClosureEnd{submap->map_T_submap.translation(),
                    has_keyframe ? nearest->keyframe_sequence : 0};
}

std::optional<ClosureEnd> end_at_keyframe(const Connection& connection, std::uint32_t map_id,
                                          std::int64_t sequence) {
  Statement row =
      connection.prepare("SELECT geom FROM trajectory WHERE map_id = ?1 AND sequence = ?2");
  if (!row.bind(std::int64_t{map_id}, sequence).step()) return std::nullopt;
  const auto point = geometry_of(row.blob(0));
  if (!point) return std::nullopt;
  return ClosureEnd{point->points_m.front(), static_cast<std::uint64_t>(sequence)};
}

std::optional<ClosureEnd> end_of(const Connection& connection, std::uint32_t map_id,
                                 std::uint64_t submap, std::int64_t sequence) {
  return submap != 0 ? end_at_submap(connection, {map_id, submap})
                     : end_at_keyframe(connection, map_id, sequence);
}

}  // namespace

void insert_closure(const Connection& connection, const model::LoopClosure& closure) {
  const geometry::SE2& pose = closure.from_T_to.mean;
  connection
      .prepare(
          "INSERT INTO understory_closures (map_id, closure_id, source, from_submap, "
          "from_sequence, to_submap, to_sequence, x_m, y_m, heading_rad) "
          "VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)")
      .bind(std::int64_t{closure.map_id}, static_cast<std::int64_t>(closure.id),
            std::string_view(closure.source), static_cast<std::int64_t>(closure.from.submap),
            static_cast<std::int64_t>(closure.from.keyframe),
            static_cast<std::int64_t>(closure.to.submap),
            static_cast<std::int64_t>(closure.to.keyframe), pose.x(), pose.y(), pose.theta())
      .run();
}

void put_closure(const Connection& connection, const model::LoopClosure& closure) {
  remove_closure(connection, closure.map_id, closure.id);
  insert_closure(connection, closure);
  redraw_closures(connection);
}

std::vector<model::LoopClosure> select_closures(const Connection& connection,
                                                std::uint32_t map_id) {
  std::vector<model::LoopClosure> closures;
  Statement row = connection.prepare(
      "SELECT closure_id, source, from_submap, from_sequence, to_submap, to_sequence, x_m, y_m, "
      "heading_rad FROM understory_closures WHERE map_id = ?1 ORDER BY number");
  row.bind(std::int64_t{map_id});
  while (row.step()) {
    model::LoopClosure& one = closures.emplace_back();
    one.map_id = map_id;
    one.id = row.count(0);
    one.source = row.text(1);
    one.from = {row.count(2), static_cast<std::uint64_t>(row.integer(3))};
    one.to = {row.count(4), static_cast<std::uint64_t>(row.integer(5))};
    one.from_T_to.mean = geometry::SE2(row.real(6), row.real(7), row.real(8));
  }
  return closures;
}

void remove_closure(const Connection& connection, std::uint32_t map_id, std::uint64_t closure_id) {
  Statement found = connection.prepare(
      "DELETE FROM understory_closures WHERE map_id = ?1 AND closure_id = ?2 RETURNING number");
  if (!found.bind(std::int64_t{map_id}, static_cast<std::int64_t>(closure_id)).step()) return;
  connection.prepare("DELETE FROM loop_closures WHERE fid = ?1")
      .bind(static_cast<std::int64_t>(landmark_id(map_id, found.count(0))))
      .run();
}

void redraw_closures(const Connection& connection) {
  LoopRows rows(connection);
  Statement row = connection.prepare(
      "SELECT number, map_id, from_submap, from_sequence, to_submap, to_sequence "
      "FROM understory_closures ORDER BY number");
  while (row.step()) {
    const std::int64_t map_number = row.integer(1);
    if (map_number < 1 || map_number > kLastMapId) connection.damaged("a closure is of no map");
    const auto map_id = static_cast<std::uint32_t>(map_number);
    const auto from = end_of(connection, map_id, row.count(2), row.integer(3));
    const auto to = end_of(connection, map_id, row.count(4), row.integer(5));
    // An end may be in a submap that is not in the file yet.
    if (!from || !to) continue;
    rows.put(static_cast<std::int64_t>(landmark_id(map_id, row.count(0))), map_id,
             {from->sequence, to->sequence, from->place_m, to->place_m});
  }
}

}  // namespace understory::map_file
