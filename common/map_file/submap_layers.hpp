// What the layers show of a drive's submaps and of the ground around the vehicle.
//
// A landmark's column `submap_id` says who it belongs to: a submap, whose pose moves it, or nobody:
// then it is in the map that the mapper holds itself.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/map_file/connection.hpp"
#include "common/map_file/submap_rows.hpp"
#include "common/model/submap.hpp"

namespace understory::map_file {

/// A keyframe's number in the layer `trajectory`: grows with time, and is the same whenever and in
/// whatever order keyframes come. Two of one map are 0.1 ms apart or more.
std::int64_t keyframe_number(std::uint32_t map_id, model::Utime utime);

/// Shows a submap that the file did not have, and makes its landmarks its own. Fault::kRefused
/// where it has what no map can have.
void show_submap(const Connection& connection, const model::Submap& submap,
                 const geometry::SE2& map_T_submap);
/// Shows a submap where it is now, as far as it still holds its landmarks and keyframes.
void redraw_submap(const Connection& connection, const PlacedSubmap& placed);
/// Shows its border where it is now.
void redraw_border(const Connection& connection, const PlacedSubmap& placed);
/// Takes away what is shown of a submap alone.
void hide_submap(const Connection& connection, const SubmapKey& key);

/// What has changed in the map that the mapper holds itself, since what was written last.
struct GroundChange {
  std::uint32_t map_id = 1;
  model::Utime utime = 0;
  std::vector<model::MapLandmark> landmarks;   ///< New and changed ones.
  std::vector<model::LandmarkId> gone;         ///< Those that are in no map any more.
  std::vector<model::KeyframePose> keyframes;  ///< New and changed ones.
  /// `landmarks` are all that the mapper holds: others that are in no submap are gone.
  bool is_whole = false;
};

/// Writes the change. A landmark that was a submap's says that the submap is back in the mapper.
/// What no map can have is left out; gives how many those were.
std::size_t show_ground(const Connection& connection, const GroundChange& change);

/// The file keeps a loop closure that counts, and the layer shows it. One with the same id is
/// replaced.
void put_closure(const Connection& connection, const model::LoopClosure& closure);
/// The file keeps it, where the layer shows it already.
void insert_closure(const Connection& connection, const model::LoopClosure& closure);
/// All closures of a map that count, in the order in which they came; without covariances, which
/// the file does not have.
std::vector<model::LoopClosure> select_closures(const Connection& connection, std::uint32_t map_id);
/// It does not count any more; nothing where the file has none.
void remove_closure(const Connection& connection, std::uint32_t map_id, std::uint64_t closure_id);
/// Shows all closures where their ends are now. O(closures).
void redraw_closures(const Connection& connection);

}  // namespace understory::map_file
