// The store without its file: selects the data to write from the mapper's messages.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/map_file/stored_existence.hpp"
#include "common/map_file/submap_layers.hpp"
#include "common/model/slam_output.hpp"
#include "common/model/submap.hpp"
#include "services/submap_store/ground.hpp"

namespace understory::submap_store {

/// Data to write, in this order.
struct Writes {
  std::vector<std::uint32_t> dropped_maps;     ///< Provisional maps that were deleted.
  std::vector<map_file::GroundChange> ground;  ///< Of earlier maps, then of the map in use.
  std::vector<model::LoopClosure> closures;    ///< Accepted or revoked.
  /// States from which the existence tracker continues, by map.
  std::vector<std::pair<std::uint32_t, map_file::StoredExistence>> existence;

  /// Whether there is nothing to write.
  bool empty() const {
    return dropped_maps.empty() && ground.empty() && closures.empty() && existence.empty();
  }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.dropped_maps, s.ground, s.closures, s.existence);
  }
};

/// Follows the mapper. Submaps are written to the file at once; this class only removes their
/// content from the ground: the part of the map in the mapper's memory. The ground is written
/// periodically, so the file contains the whole drive. Memory: changes since the last write (of
/// existence: one state per landmark), and a pose per submap.
class SubmapStore {
 public:
  /// Whether this keyframe begins a map that a file with maps up to `highest_map` already has: then
  /// the mapper was restarted, and a new drive begins.
  static bool begins_drive(const model::MapUpdate& update, std::uint32_t highest_map);

  /// MAP. One that is cut to bounds is skipped.
  void take(const model::WholeMap& map);
  /// MAP_DELTA.
  void take(const model::MapDelta& delta);
  /// SLAM_UPDATE.
  void take(const model::MapUpdate& update);
  /// MAP_CORRECTION.
  void take(const model::MapCorrection& correction);
  /// LOOP_CLOSURE: kept until the mapper's result arrives.
  void take(const model::LoopClosure& closure);
  /// LOOP_RESULT.
  void take(const model::LoopResult& result);
  /// EXISTENCE_STATE that passed map_file::fault_of(). A state of a map that the mapper has not
  /// begun yet waits for the map.
  void take(const model::ExistenceState& state);

  /// Pose of a submap: its own, or that of a later correction.
  geometry::SE2 pose_of(const model::Submap& submap) const;
  /// A submap is in the file: its landmarks and keyframes leave the ground.
  void stored(const model::Submap& submap);
  /// Starts with a new, empty file: the ground must be written as a whole.
  void begin_drive();

  /// Continues the drive in another file: the ground must be written as a whole.
  void begin_file() { ground_.want_whole(); }

  /// Makes up to `most` waiting landmarks of the ground due, in rotation.
  void draw_moved(std::size_t most) { ground_.draw(most); }
  /// The data to write, without waiting landmarks of the ground.
  Writes due() const;
  /// All of due() is in the file.
  void written();
  /// Whether the ground is incomplete: changes were missed, or the store started after the mapper.
  bool wants_whole() const { return ground_.wants_whole(); }

  /// The state as bytes.
  std::string save() const;
  /// Continues from a saved state; requests the whole ground, since messages may have been missed.
  /// Throws std::invalid_argument.
  void load(const std::string& state);

 private:
  void go_to(std::uint32_t map_id);
  void forget(const model::MapDelta& delta);

  Ground ground_;
  bool is_provisional_ = false;                     ///< Of the map in use, by its last keyframe.
  Writes left_;                                     ///< Of all maps but the one in use.
  std::optional<model::MapCorrection> correction_;  ///< The newest.
  std::map<std::uint64_t, model::LoopClosure> proposed_;          ///< By id; of the map in use.
  std::map<std::uint32_t, map_file::NewestExistence> existence_;  ///< Not written yet, by map.
};

}  // namespace understory::submap_store
