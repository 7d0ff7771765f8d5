// What the existence tracker goes on with on the next drive, as it is stored with a map.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "common/model/existence.hpp"

namespace understory::map_file {

class MapFile;

/// Landmarks in one message of existence_of() at most.
inline constexpr std::size_t kStatesTogether = 200;

/// Of one landmark.
struct ExistenceRow {
  model::LandmarkExistence existence;  ///< Its id, its probability, whether it is in use.
  model::Utime utime = 0;              ///< Of the keyframe after which this holds [us].
  std::string state;                   ///< The tracker's bytes; at least one.
  bool operator==(const ExistenceRow&) const = default;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.existence, s.utime, s.state);
  }
};

/// Of a map.
struct StoredExistence {
  model::Utime utime = 0;  ///< Of the keyframe after which `learned` holds [us].
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

/// The newest state of each landmark, from EXISTENCE_STATE as it comes. Of two with one
/// stamp the later message counts. Memory: O(landmarks).
class NewestExistence {
 public:
  /// O(landmarks of the message * log). Precondition: fault_of() finds nothing in the message.
  void take(const model::ExistenceState& state);
  /// Forgets a landmark that is no more. O(log).
  void drop(model::LandmarkId id) { rows_.erase(id); }
  /// Forgets all landmarks that a map has given ids to. O(landmarks of it).
  void drop_given_by(std::uint32_t map_id);
  /// Whether nothing was taken.
  bool empty() const { return !has_learned_ && rows_.empty(); }
  /// All of it. O(landmarks).
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

/// What no map can have in such a message: a landmark of no map or of a later one, a probability
/// beyond 0 to 1, a landmark without state, ids that do not ascend; empty where nothing is wrong.
std::string fault_of(const model::ExistenceState& state);
/// The same of what is stored with a map that has these landmarks, ids ascending: each landmark
/// with a state is one of them.
std::string fault_of(const StoredExistence& existence, std::span<const model::LandmarkId> ids);

/// What is stored as messages of EXISTENCE_STATE, of kStatesTogether landmarks at most and of one
/// number of bytes for each landmark; numbered from 0, stamped with the newest state in each. At
/// least one message, since it carries what was learned.
std::vector<model::ExistenceState> messages_of(std::uint32_t map_id,
                                               const StoredExistence& existence);
/// The state with which the tracker starts in a stored map, as messages; none where the map was
/// stored without. Throws MapFileError as MapFile::read() does. O(size of the map).
std::vector<model::ExistenceState> existence_of(const MapFile& file, std::uint32_t map_id);

}  // namespace understory::map_file
