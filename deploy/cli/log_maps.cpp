#include "deploy/cli/log_maps.hpp"

#include <algorithm>
#include <set>

#include "common/wire/convert.hpp"

namespace understory::cli {
namespace {

/// Number of a message's map; 0 where its landmarks do not determine it. Maps merged into it have
/// smaller numbers.
std::uint32_t map_id_of(const std::vector<model::MapLandmark>& landmarks) {
  return landmarks.empty() ? 0 : model::map_of(landmarks.back().id);
}

/// The states of these landmarks, ids ascending.
std::optional<map_file::StoredExistence> states_of(const std::vector<model::MapLandmark>& landmarks,
                                                   const map_file::StoredExistence& all) {
  map_file::StoredExistence result{all.utime, all.learned, {}};
  for (const map_file::ExistenceRow& row : all.landmarks) {
    if (std::ranges::binary_search(landmarks, row.existence.id, {}, &model::MapLandmark::id))
      result.landmarks.push_back(row);
  }
  if (result.landmarks.empty()) return std::nullopt;
  return result;
}

/// Removes the maps whose landmarks are in a later one.
void drop_joined(std::map<std::uint32_t, LogMaps::Found>& maps) {
  std::set<std::uint32_t> joined;
  for (const auto& [map_id, found] : maps) {
    for (const model::MapLandmark& landmark : found.map.landmarks) {
      if (model::map_of(landmark.id) < map_id) joined.insert(model::map_of(landmark.id));
    }
  }
  for (const std::uint32_t map_id : joined) maps.erase(map_id);
}

}  // namespace

void LogMaps::add(const io::LogEvent& event) {
  if (event.channel == "MAP") {
    if (const auto whole = wire::decode_message<model::WholeMap>(event.data)) on_map(*whole);
  } else if (event.channel == "MAP_DELTA") {
    if (const auto delta = wire::decode_message<model::MapDelta>(event.data)) on_delta(*delta);
  } else if (event.channel == "SUBMAP") {
    const auto submap = wire::decode_message<model::Submap>(event.data);
    if (submap && submap->map_id == map_id_) held_.take(*submap);
  } else if (event.channel == "MAP_CORRECTION") {
    const auto correction = wire::decode_message<model::MapCorrection>(event.data);
    if (correction && correction->map_id == map_id_) held_.take(*correction);
  } else if (event.channel == "SLAM_UPDATE") {
    if (const auto update = wire::decode_message<model::MapUpdate>(event.data)) on_update(*update);
  } else if (event.channel == "EXISTENCE_STATE") {
    const auto state = wire::decode_message<model::ExistenceState>(event.data);
    if (state && map_file::fault_of(*state).empty()) existence_.take(*state);
  }
}

void LogMaps::on_map(const model::WholeMap& whole) {
  if (!whole.complete) return;
  go_to(map_id_of(whole.landmarks));
  held_.take(whole);
}

void LogMaps::on_delta(const model::MapDelta& delta) {
  // Only the first change of a map comes before anything else that names it.
  if (delta.base_version == 0) go_to(map_id_of(delta.added));
  held_.take(delta);
}

void LogMaps::on_update(const model::MapUpdate& update) {
  const bool starts = update.status == model::MapUpdateStatus::kFirstMap;
  // After a restart of the mapper, landmarks of this map number are different ones.
  if (starts) existence_.drop_given_by(update.map_id);
  if (starts || map_id_ == 0) go_to(update.map_id);
  held_.take(update);
  is_provisional_ = update.is_provisional;
}

std::map<std::uint32_t, LogMaps::Found> LogMaps::take() {
  // The map in use at the end is always kept.
  is_provisional_ = false;
  keep();
  drop_joined(left_);
  const map_file::StoredExistence all = existence_.stored();
  for (auto& [map_id, found] : left_) found.existence = states_of(found.map.landmarks, all);
  return std::move(left_);
}

void LogMaps::go_to(std::uint32_t map_id) {
  if (map_id == 0 || map_id == map_id_) return;
  keep();
  held_ = model::HeldMap();
  is_provisional_ = false;
  map_id_ = map_id;
}

void LogMaps::keep() {
  if (map_id_ == 0 || is_provisional_ || !held_.map()) return;
  left_.insert_or_assign(map_id_, Found{*held_.whole(), held_.missed(), std::nullopt});
}

}  // namespace understory::cli
