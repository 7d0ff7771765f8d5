// Shows a drive's submaps and the ground around the vehicle in the layers.
//
// A landmark's column `submap_id` states its submap, whose pose moves it; NULL: it is in the
// mapper's memory.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/map_file/connection.hpp"
#include "common/map_file/submap_rows.hpp"
#include "common/model/submap.hpp"

namespace understory::map_file {

/// A keyframe's number in the layer `trajectory`: it grows with time and does not depend on the
/// order of arrival. Two keyframes of one map are at least 0.1 ms apart.
std::int64_t keyframe_number(std::uint32_t map_id, model::Utime utime);

/// Shows a new submap and assigns its landmarks to it. Fault::kRefused where it is invalid.
void show_submap(const Connection& connection, const model::Submap& submap,
                 const geometry::SE2& map_T_submap);
/// Shows a submap at its present pose, with the landmarks and keyframes that it still has.
void redraw_submap(const Connection& connection, const PlacedSubmap& placed);
/// Shows its border at its present pose.
void redraw_border(const Connection& connection, const PlacedSubmap& placed);
/// Removes the features of this submap alone.
void hide_submap(const Connection& connection, const SubmapKey& key);

/// Changes of the map in the mapper's memory since the last write.
struct GroundChange {
  std::uint32_t map_id = 1;
  model::Utime utime = 0;
  std::vector<model::MapLandmark> landmarks;   ///< New and changed landmarks.
  std::vector<model::LandmarkId> gone;         ///< Landmarks no longer in any map.
  std::vector<model::KeyframePose> keyframes;  ///< New and changed keyframes.
  /// `landmarks` are all in the mapper's memory: others without a submap are removed.
  bool is_whole = false;
};

/// Writes the change. If a landmark was in a submap, the mapper has taken that submap back. Invalid
/// landmarks and keyframes are left out; returns their number.
std::size_t show_ground(const Connection& connection, const GroundChange& change);

/// Stores a valid loop closure and shows it in the layer. One with the same id is replaced.
void put_closure(const Connection& connection, const model::LoopClosure& closure);
/// Stores it when the layer shows it already.
void insert_closure(const Connection& connection, const model::LoopClosure& closure);
/// All valid closures of a map in order of arrival, without covariances, which are not in the file.
std::vector<model::LoopClosure> select_closures(const Connection& connection, std::uint32_t map_id);
/// Removes a closure; no effect where the file has none.
void remove_closure(const Connection& connection, std::uint32_t map_id, std::uint64_t closure_id);
/// Shows all closures at the present positions of their ends. O(closures).
void redraw_closures(const Connection& connection);

}  // namespace understory::map_file
