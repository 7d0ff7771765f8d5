// Submaps as rows of understory_submaps and understory_submap_poses.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/map_file/connection.hpp"
#include "common/model/submap.hpp"

namespace understory::map_file {

/// Key of a submap.
struct SubmapKey {
  std::uint32_t map_id = 1;
  model::SubmapId id = 0;
};

/// State of a submap in a file, without its content.
struct SubmapState {
  std::uint64_t content_hash = 0;
  std::string state;  ///< One of submap_tables.hpp.
};

/// A submap's latest pose.
struct PlacedSubmap {
  SubmapKey key;
  geometry::SE2 map_T_submap;
};

/// State of a submap; none if it was never in the file.
std::optional<SubmapState> state_of(const Connection& connection, const SubmapKey& key);
/// Writes the rows of a new submap at the pose. O(size).
void insert_submap(const Connection& connection, const model::Submap& submap,
                   const geometry::SE2& map_T_submap);
/// Reads a submap at its latest pose; its landmarks are rounded (submap_codec.hpp). None where the
/// file does not have its content. Fault::kDamaged where it is damaged. O(size).
std::optional<model::Submap> select_submap(const Connection& connection, const SubmapKey& key);
/// Its border, frame submap. Fault::kDamaged where it is unreadable.
std::vector<Eigen::Vector2d> select_border(const Connection& connection, const SubmapKey& key);
/// Its content is now in another submap: keeps the row, removes the bytes and the pose.
void replace_submap(const Connection& connection, const SubmapKey& key);
/// Sets its state.
void set_state(const Connection& connection, const SubmapKey& key, std::string_view state);

/// Its latest pose; none = no pose.
std::optional<geometry::SE2> pose_of(const Connection& connection, const SubmapKey& key);
/// Stores poses that are newer than those in the file, marks moved submaps as not drawn, and
/// returns them. Unknown submaps are skipped.
std::vector<PlacedSubmap> update_poses(const Connection& connection,
                                       const model::MapCorrection& correction);
/// Sets the pose of a submap in the file when the layers show it already. Fault::kRefused where the
/// file has none.
void place_submap(const Connection& connection, const PlacedSubmap& placed);
/// At most `most` submaps that the layers do not show at their present poses.
std::vector<PlacedSubmap> to_draw(const Connection& connection, std::size_t most);
/// Marks it as drawn at its present pose.
void set_drawn(const Connection& connection, const SubmapKey& key);

/// All submaps with content in the file, by map and number.
std::vector<SubmapKey> stored_submaps(const Connection& connection);
/// Faults of the submaps: damaged ones, poses without submaps, submaps without poses.
std::vector<std::string> faults_of_submaps(const Connection& connection);

}  // namespace understory::map_file
