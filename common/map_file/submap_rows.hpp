// Submaps as rows of understory_submaps and understory_submap_poses.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/map_file/connection.hpp"
#include "common/model/submap.hpp"

namespace understory::map_file {

/// Which submap.
struct SubmapKey {
  std::uint32_t map_id = 1;
  model::SubmapId id = 0;
};

/// What a file says of a submap without looking at its content.
struct SubmapState {
  std::uint64_t content_hash = 0;
  std::string state;  ///< One of submap_tables.hpp.
};

/// Where a submap is, by its latest pose.
struct PlacedSubmap {
  SubmapKey key;
  geometry::SE2 map_T_submap;
};

/// None where the file has not had it.
std::optional<SubmapState> state_of(const Connection& connection, const SubmapKey& key);
/// Writes the rows of a submap that the file has not had, at the pose. O(size).
void insert_submap(const Connection& connection, const model::Submap& submap,
                   const geometry::SE2& map_T_submap);
/// A submap as it was inserted, but for the rounding of its landmarks (submap_codec.hpp), at its
/// latest pose; none where the file does not have its content. Fault::kDamaged where it is not what
/// was written. O(size).
std::optional<model::Submap> select_submap(const Connection& connection, const SubmapKey& key);
/// Its border, frame submap. Fault::kDamaged where it cannot be read.
std::vector<Eigen::Vector2d> select_border(const Connection& connection, const SubmapKey& key);
/// Its content is in another one: the row stays, the bytes and the pose go.
void replace_submap(const Connection& connection, const SubmapKey& key);
/// Says what has become of it.
void set_state(const Connection& connection, const SubmapKey& key, std::string_view state);

/// Its latest pose; none where it has none.
std::optional<geometry::SE2> pose_of(const Connection& connection, const SubmapKey& key);
/// Takes over poses that are newer than those in the file, and marks what moved as not drawn. Gives
/// what moved. Submaps that the file has not are passed over.
std::vector<PlacedSubmap> update_poses(const Connection& connection,
                                       const model::MapCorrection& correction);
/// Puts a submap that the file has at a pose which the layers show already. Fault::kRefused where
/// the file has none.
void place_submap(const Connection& connection, const PlacedSubmap& placed);
/// At most so many submaps that the layers do not show where they are.
std::vector<PlacedSubmap> to_draw(const Connection& connection, std::size_t most);
/// The layers show it where it is.
void set_drawn(const Connection& connection, const SubmapKey& key);

/// All submaps whose content the file has, by map and number.
std::vector<SubmapKey> stored_submaps(const Connection& connection);
/// What is wrong with the submaps: damaged ones, poses without submap and the other way round.
std::vector<std::string> faults_of_submaps(const Connection& connection);

}  // namespace understory::map_file
