// The existence tracker's state for the next drive, stored with a map.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "common/model/existence.hpp"

namespace understory::map_file {

class MapFile;

/// Largest number of landmarks in one message of existence_of().
inline constexpr std::size_t kStatesTogether = 200;

/// Stored state of one landmark.
struct ExistenceRow {
  model::LandmarkExistence existence;  ///< Its id, its probability, whether it is in use.
  model::Utime utime = 0;              ///< Stamp of the keyframe after which this is valid [us].
  std::string state;                   ///< The tracker's bytes; at least one.
  bool operator==(const ExistenceRow&) const = default;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.existence, s.utime, s.state);
  }
};

/// Stored state of a map.
struct StoredExistence {
  model::Utime utime = 0;  ///< Stamp of the keyframe after which `learned` is valid [us].
  /// The tracker's bytes on detector and world, for all landmarks: ExistenceState::model.
  std::string learned;
  std::vector<ExistenceRow> landmarks;  ///< In order of id.
  bool operator==(const StoredExistence&) const = default;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.utime, s.learned, s.landmarks);
  }
};

/// The newest state of each landmark, from received EXISTENCE_STATE messages. Of two with equal
/// stamps the later message is used. Memory: O(landmarks).
class NewestExistence {
 public:
  /// O(landmarks of the message * log). Precondition: fault_of() of the message is empty.
  void take(const model::ExistenceState& state);
  /// Drops a removed landmark. O(log).
  void drop(model::LandmarkId id) { rows_.erase(id); }
  /// Drops all landmarks whose ids were assigned by a map. O(landmarks of it).
  void drop_given_by(std::uint32_t map_id);
  /// Whether nothing was taken.
  bool empty() const { return !has_learned_ && rows_.empty(); }
  /// The complete state. O(landmarks).
  StoredExistence stored() const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.has_learned_, self.utime_, self.learned_, self.rows_);
  }

 private:
  bool has_learned_ = false;
  model::Utime utime_ = 0;
  std::string learned_;
  std::map<model::LandmarkId, ExistenceRow> rows_;
};

/// Fault of such a message: a landmark of no map or of a later one, a probability outside 0 to 1, a
/// landmark without state, ids not ascending; empty = no fault.
std::string fault_of(const model::ExistenceState& state);
/// The same for the state stored with a map of these landmarks (ids ascending): each landmark with
/// a state must be one of them.
std::string fault_of(const StoredExistence& existence, std::span<const model::LandmarkId> ids);

/// The stored state as messages of EXISTENCE_STATE, each with at most kStatesTogether landmarks and
/// an equal number of bytes per landmark; numbered from 0, stamped with the newest state in each.
/// At least one message, because it carries the learned values.
std::vector<model::ExistenceState> messages_of(std::uint32_t map_id,
                                               const StoredExistence& existence);
/// The state with which the tracker starts in a stored map, as messages; none if the map was stored
/// without one. Throws MapFileError like MapFile::read(). O(size of the map).
std::vector<model::ExistenceState> existence_of(const MapFile& file, std::uint32_t map_id);

}  // namespace understory::map_file
