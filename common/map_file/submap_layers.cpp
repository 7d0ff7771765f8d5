#include "common/map_file/submap_layers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "common/map_file/layer_rows.hpp"
#include "common/map_file/submap_tables.hpp"

namespace understory::map_file {
namespace {

/// Unit of keyframe_number() [us].
constexpr model::Utime kKeyframeUnit_us = 100;
constexpr std::uint64_t kMostCounter = (std::uint64_t{1} << model::kLandmarkCounterBits) - 1;

std::int64_t border_number(const SubmapKey& key) {
  return static_cast<std::int64_t>(landmark_id(key.map_id, std::min(key.id, kMostCounter)));
}

StoredLandmark placed_landmark(const model::MapLandmark& landmark,
                               const geometry::SE2& map_T_submap, model::SubmapId submap) {
  StoredLandmark result{landmark, submap, std::nullopt};
  const Eigen::Matrix2d rotation = map_T_submap.rotation();
  result.landmark.position_m = map_T_submap * landmark.position_m;
  result.landmark.covariance_m2 = rotation * landmark.covariance_m2 * rotation.transpose();
  return result;
}

model::KeyframePose placed_keyframe(model::KeyframePose pose, const geometry::SE2& map_T_submap) {
  pose.map_T_vehicle = map_T_submap * pose.map_T_vehicle;
  return pose;
}

[[noreturn]] void refuse_submap(const Connection& connection, const model::Submap& submap,
                                const std::string& why) {
  throw MapFileError(Fault::kRefused,
                     fmt::format("{}: submap {} of map {} is not stored: {}",
                                 connection.file().string(), submap.id, submap.map_id, why));
}

void require_content(const Connection& connection, const model::Submap& submap,
                     const geometry::SE2& map_T_submap) {
  for (const model::MapLandmark& one : submap.landmarks) {
    const std::string fault =
        fault_of(placed_landmark(one, map_T_submap, submap.id), submap.map_id);
    if (!fault.empty())
      refuse_submap(connection, submap, fmt::format("landmark {}: {}", one.id, fault));
  }
  for (const model::KeyframePose& one : submap.keyframes) {
    const std::string fault = fault_of(placed_keyframe(one, map_T_submap));
    if (!fault.empty())
      refuse_submap(connection, submap,
                    fmt::format("keyframe {}: {}", one.keyframe_sequence, fault));
  }
}

/// Ids of landmarks of a map that are in no submap.
std::vector<model::LandmarkId> ground_landmarks(const Connection& connection,
                                                std::uint32_t map_id) {
  std::vector<model::LandmarkId> ids;
  Statement row = connection.prepare(
      "SELECT landmark_id FROM landmarks WHERE map_id = ?1 AND submap_id IS NULL");
  row.bind(std::int64_t{map_id});
  while (row.step()) ids.push_back(row.count(0));
  return ids;
}

/// Marks the submaps of these landmarks as taken back.
void note_back(const Connection& connection, const GroundChange& change) {
  Statement owner = connection.prepare(
      "SELECT submap_id FROM landmarks WHERE landmark_id = ?1 AND submap_id IS NOT NULL");
  std::set<model::SubmapId> back;
  for (const model::MapLandmark& one : change.landmarks) {
    if (owner.bind(static_cast<std::int64_t>(one.id)).step()) back.insert(owner.count(0));
  }
  for (const model::SubmapId id : back) {
    const SubmapKey key{change.map_id, id};
    const auto state = state_of(connection, key);
    if (state && state->state == kAway) set_state(connection, key, kBack);
  }
}

}  // namespace

std::int64_t keyframe_number(std::uint32_t map_id, model::Utime utime) {
  const model::Utime units = std::max<model::Utime>(utime, 0) / kKeyframeUnit_us;
  const auto counter = std::min(static_cast<std::uint64_t>(units) + 1, kMostCounter);
  return static_cast<std::int64_t>(landmark_id(map_id, counter));
}

void show_submap(const Connection& connection, const model::Submap& submap,
                 const geometry::SE2& map_T_submap) {
  require_content(connection, submap, map_T_submap);
  LandmarkRows landmarks(connection, SameLandmark::kReplaced);
  for (const model::MapLandmark& one : submap.landmarks)
    landmarks.put(submap.map_id, placed_landmark(one, map_T_submap, submap.id));
  KeyframeRows keyframes(connection);
  for (const model::KeyframePose& one : submap.keyframes)
    keyframes.put(keyframe_number(submap.map_id, one.utime), submap.map_id,
                  placed_keyframe(one, map_T_submap));
  redraw_border(connection, {{submap.map_id, submap.id}, map_T_submap});
}

void redraw_submap(const Connection& connection, const PlacedSubmap& placed) {
  const auto state = state_of(connection, placed.key);
  // The mapper determines the pose of a submap taken back.
  if (!state || state->state != kAway) return;
  const auto submap = select_submap(connection, placed.key);
  Statement owned =
      connection.prepare("SELECT 1 FROM landmarks WHERE landmark_id = ?1 AND submap_id = ?2");
  LandmarkRows landmarks(connection, SameLandmark::kReplaced);
  for (const model::MapLandmark& one : submap->landmarks) {
    const bool is_own =
        owned.bind(static_cast<std::int64_t>(one.id), static_cast<std::int64_t>(placed.key.id))
            .step();
    if (is_own)
      landmarks.put(placed.key.map_id, placed_landmark(one, placed.map_T_submap, placed.key.id));
  }
  KeyframeRows keyframes(connection);
  for (const model::KeyframePose& one : submap->keyframes)
    keyframes.put(keyframe_number(placed.key.map_id, one.utime), placed.key.map_id,
                  placed_keyframe(one, placed.map_T_submap));
}

void redraw_border(const Connection& connection, const PlacedSubmap& placed) {
  SubmapBorder border{placed.key.id, select_border(connection, placed.key)};
  for (Eigen::Vector2d& corner : border.corners_m) corner = placed.map_T_submap * corner;
  BorderRows(connection).put(border_number(placed.key), placed.key.map_id, border);
}

void hide_submap(const Connection& connection, const SubmapKey& key) {
  const auto submap = select_submap(connection, key);
  if (!submap) return;
  Statement remove =
      connection.prepare("DELETE FROM landmarks WHERE landmark_id = ?1 AND submap_id = ?2");
  for (const model::MapLandmark& one : submap->landmarks)
    remove.bind(static_cast<std::int64_t>(one.id), static_cast<std::int64_t>(key.id)).run();
  connection.prepare("DELETE FROM submap_borders WHERE fid = ?1").bind(border_number(key)).run();
}

std::size_t show_ground(const Connection& connection, const GroundChange& change) {
  note_back(connection, change);
  std::size_t left_out = 0;
  LandmarkRows landmarks(connection, SameLandmark::kReplaced);
  for (const model::MapLandmark& one : change.landmarks) {
    const StoredLandmark stored{one, std::nullopt, std::nullopt};
    if (fault_of(stored, change.map_id).empty()) {
      landmarks.put(change.map_id, stored);
    } else {
      ++left_out;
    }
  }

  std::vector<model::LandmarkId> gone = change.gone;
  if (change.is_whole) {
    std::set<model::LandmarkId> held;
    for (const model::MapLandmark& one : change.landmarks) held.insert(one.id);
    for (const model::LandmarkId id : ground_landmarks(connection, change.map_id))
      if (!held.contains(id)) gone.push_back(id);
  }
  Statement remove =
      connection.prepare("DELETE FROM landmarks WHERE landmark_id = ?1 AND map_id = ?2");
  for (const model::LandmarkId id : gone)
    remove.bind(static_cast<std::int64_t>(id), std::int64_t{change.map_id}).run();

  KeyframeRows keyframes(connection);
  for (const model::KeyframePose& one : change.keyframes) {
    if (fault_of(one).empty()) {
      keyframes.put(keyframe_number(change.map_id, one.utime), change.map_id, one);
    } else {
      ++left_out;
    }
  }
  return left_out;
}

}  // namespace understory::map_file
