// The store without its file: what of the mapper's messages is to be written, and when.
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

/// What is to be written, in this order.
struct Writes {
  std::vector<std::uint32_t> dropped_maps;     ///< Young maps that were given up.
  std::vector<map_file::GroundChange> ground;  ///< Of maps that are not in use any more, and of it.
  std::vector<model::LoopClosure> closures;    ///< They count; or they were taken back.
  /// What the existence tracker goes on with, by map.
  std::vector<std::pair<std::uint32_t, map_file::StoredExistence>> existence;

  /// Whether there is nothing.
  bool empty() const {
    return dropped_maps.empty() && ground.empty() && closures.empty() && existence.empty();
  }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.dropped_maps, s.ground, s.closures, s.existence);
  }
};

/// Follows the mapper. Submaps go to the file at once and are no business of this class, but for
/// what they take out of the ground: the map that the mapper holds itself. The ground is written
/// now and then, so that the file has all of a drive. Memory: what has changed since it was written
/// last (of existence: one state for each landmark), and a pose for each submap.
class SubmapStore {
 public:
  /// Whether this keyframe begins a map that a file with maps up to `highest_map` has already: the
  /// mapper was started anew, and so is the drive.
  static bool begins_drive(const model::MapUpdate& update, std::uint32_t highest_map);

  /// MAP. One that is cut to bounds is passed over.
  void take(const model::WholeMap& map);
  /// MAP_DELTA.
  void take(const model::MapDelta& delta);
  /// SLAM_UPDATE.
  void take(const model::MapUpdate& update);
  /// MAP_CORRECTION.
  void take(const model::MapCorrection& correction);
  /// LOOP_CLOSURE: remembered until the mapper says what became of it.
  void take(const model::LoopClosure& closure);
  /// LOOP_RESULT.
  void take(const model::LoopResult& result);
  /// EXISTENCE_STATE, in which map_file::fault_of() finds nothing. That of a map which the mapper
  /// has not begun yet waits until it has.
  void take(const model::ExistenceState& state);

  /// Where a submap is: its own pose, or that of a later correction.
  geometry::SE2 pose_of(const model::Submap& submap) const;
  /// A submap is in the file: its landmarks and keyframes are not the ground's any more.
  void stored(const model::Submap& submap);
  /// The file is another one, without anything in it: the ground must be written whole.
  void begin_drive();

  /// The drive goes on in another file: the ground must be written whole.
  void begin_file() { ground_.want_whole(); }

  /// So many landmarks of the ground that have moved are due, of all that wait each in its turn.
  void draw_moved(std::size_t most) { ground_.draw(most); }
  /// What is to be written, without the landmarks of the ground that have moved and wait.
  Writes due() const;
  /// All of due() is in the file.
  void written();
  /// Whether the ground is not known as a whole: changes were missed, or the store began later than
  /// the mapper.
  bool wants_whole() const { return ground_.wants_whole(); }

  /// The state as bytes.
  std::string save() const;
  /// Goes on with what save() gave; asks for the whole ground, since messages may have been missed.
  /// Throws std::invalid_argument.
  void load(const std::string& state);

 private:
  void go_to(std::uint32_t map_id);
  void forget(const model::MapDelta& delta);

  Ground ground_;
  bool is_provisional_ = false;                           ///< The map in use, by its last keyframe.
  Writes left_;                                           ///< But for the map in use.
  std::optional<model::MapCorrection> correction_;        ///< The newest one.
  std::map<std::uint64_t, model::LoopClosure> proposed_;  ///< By id; of the map in use.
  std::map<std::uint32_t, map_file::NewestExistence> existence_;  ///< Not written yet, by map.
};

}  // namespace understory::submap_store
