// The part of the map in the mapper's memory, as far as it is not written yet.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "common/map_file/submap_layers.hpp"
#include "common/model/archive.hpp"
#include "common/model/slam_output.hpp"
#include "common/model/submap.hpp"

namespace understory::map_file {

/// Members of a saved GroundChange; see common/state.
template <class Archive, class Self>
requires state::Is<Self, GroundChange>
void archive(Archive& a, Self& s) {
  a(s.map_id, s.utime, s.landmarks, s.gone, s.keyframes, s.is_whole);
}

}  // namespace understory::map_file

namespace understory::submap_store {

/// Changes by MAP, MAP_DELTA and SLAM_UPDATE of one map that are not written yet. Landmarks that
/// MAP_DELTA moves wait until draw(): while a loop closes, each keyframe moves all of them by some
/// centimetres. Memory: O(changes).
class Ground {
 public:
  /// Without a map.
  Ground() = default;
  /// For the map with this number, from its start.
  explicit Ground(std::uint32_t map_id) : map_id_(map_id) {}

  /// Number of the map; 0 = none yet.
  std::uint32_t map_id() const { return map_id_; }
  /// Sets all that the mapper has in memory.
  void take(const model::WholeMap& map);
  /// Applies a change. One with an older version is skipped.
  void take(const model::MapDelta& delta);
  /// Adds a keyframe that the map has accepted.
  void take(const model::MapUpdate& update);
  /// Removes the landmarks and keyframes of a submap that was handed over.
  void hand_over(const model::Submap& submap);

  /// Releases up to `most` of the waiting landmarks, in rotation.
  void draw(std::size_t most);
  /// The changes to write, without the waiting landmarks; none if there are none.
  std::optional<map_file::GroundChange> change() const;
  /// The result of change() is written completely.
  void written();
  /// Whether the whole map must be requested: changes were missed, or the map began before this
  /// object.
  bool wants_whole() const { return map_id_ != 0 && wants_whole_; }
  /// From now on changes may have been missed.
  void want_whole() { wants_whole_ = true; }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.map_id_, self.utime_, self.version_, self.landmarks_, self.moved_, self.next_moved_,
      self.gone_, self.keyframes_, self.is_whole_, self.wants_whole_);
  }

 private:
  void put(const model::MapLandmark& landmark);
  void move(const model::MapLandmark& landmark);
  void remove(model::LandmarkId id);

  std::uint32_t map_id_ = 0;
  model::Utime utime_ = 0;
  std::uint64_t version_ = 0;
  std::map<model::LandmarkId, model::MapLandmark> landmarks_;
  std::map<model::LandmarkId, model::MapLandmark>
      moved_;                         ///< Waiting; the file has an older position of each.
  model::LandmarkId next_moved_ = 0;  ///< The next landmark in rotation, or the one after.
  std::map<model::LandmarkId, bool> gone_;
  std::map<model::Utime, model::KeyframePose> keyframes_;
  bool is_whole_ = false;  ///< `landmarks_` are all that the mapper has in memory.
  bool wants_whole_ = false;
};

}  // namespace understory::submap_store
