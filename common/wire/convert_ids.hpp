// Landmark ids and merges of maps and updates.
#pragma once

#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "common/model/map.hpp"
#include "common/wire/checks.hpp"
#include "understory/merge_t.hpp"

namespace understory::wire {

/// A landmark's id.
inline model::LandmarkId landmark_id(std::int64_t wire, Checks& checks) {
  checks.consistent(wire != 0, "landmark id is not 0");
  return static_cast<model::LandmarkId>(wire);
}

/// A list of ids.
inline std::vector<model::LandmarkId> ids(std::string_view field,
                                          const std::vector<std::int64_t>& wire, Checks& checks) {
  std::vector<model::LandmarkId> result;
  result.reserve(wire.size());
  for (std::size_t i = 0; i < wire.size(); ++i) {
    checks.in(field, i);
    result.push_back(landmark_id(wire[i], checks));
  }
  return result;
}

/// Pairs old, new.
using Merges = std::vector<std::pair<model::LandmarkId, model::LandmarkId>>;

/// Merges of a message.
inline Merges merges(const std::vector<merge_t>& wire, Checks& checks) {
  Merges result;
  result.reserve(wire.size());
  for (std::size_t i = 0; i < wire.size(); ++i) {
    checks.in("merged", i);
    result.emplace_back(landmark_id(wire[i].old_id, checks), landmark_id(wire[i].new_id, checks));
  }
  return result;
}

/// The opposite of merges().
inline std::vector<merge_t> to_wire(const Merges& merges) {
  std::vector<merge_t> wire;
  wire.reserve(merges.size());
  for (const auto& [old_id, new_id] : merges) {
    merge_t& out = wire.emplace_back();
    out.old_id = static_cast<std::int64_t>(old_id);
    out.new_id = static_cast<std::int64_t>(new_id);
  }
  return wire;
}

/// The counts of lists in both types.
template <class Wire>
void copy_counts(Wire& wire) {
  wire.num_added = static_cast<std::int32_t>(wire.added.size());
  wire.num_removed = static_cast<std::int32_t>(wire.removed.size());
  wire.num_merged = static_cast<std::int32_t>(wire.merged.size());
}

}  // namespace understory::wire
