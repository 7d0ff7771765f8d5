// A stored map: the content of a map file for one map number.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/map_file/stored_existence.hpp"
#include "common/model/map.hpp"

namespace understory::map_file {

/// Map numbers are 1 to this: a landmark's id is the number of its row, which is signed.
inline constexpr std::uint32_t kLastMapId = 32767;
/// Coordinates lie within this distance of the frame's origin, in x and in y [m].
inline constexpr double kFarthestM = 1e9;

/// A landmark and its stored properties. The map number in its id is that of its map, or of an
/// earlier map merged into it.
struct StoredLandmark {
  model::MapLandmark landmark;             ///< Frame `map`.
  std::optional<std::uint64_t> submap_id;  ///< Its submap.
  std::optional<double> existence;         ///< Probability of existence, 0 to 1.
};

/// Border of a submap, frame `map`.
struct SubmapBorder {
  std::uint64_t submap_id = 0;
  std::vector<Eigen::Vector2d> corners_m;  ///< Three or more, without repeating the first one.
};

/// Two keyframes between which a loop was closed.
struct LoopClosure {
  std::uint64_t from_sequence = 0;  ///< KeyframePose::keyframe_sequence.
  std::uint64_t to_sequence = 0;
  Eigen::Vector2d from_m = Eigen::Vector2d::Zero();  ///< Their positions, frame `map`.
  Eigen::Vector2d to_m = Eigen::Vector2d::Zero();
};

/// One map. A map that is stored and read again is equal to the bit, except that covariances become
/// symmetric and -0.0 becomes 0.0.
struct StoredMap {
  /// 1 to kLastMapId; upper 16 bits of its landmarks' ids. Landmarks of merged maps have the
  /// smaller numbers of those maps.
  std::uint32_t map_id = 1;
  std::string name;                            ///< For people; may be empty.
  model::Utime created_utime = 0;              ///< Stamp of its source, or time of creation [us].
  std::string origin;                          ///< Its source, e.g. the name of a log.
  std::vector<StoredLandmark> landmarks;       ///< In order of id.
  std::vector<model::KeyframePose> keyframes;  ///< In order of time.
  std::vector<SubmapBorder> submap_borders;
  std::vector<LoopClosure> loop_closures;
  /// The existence tracker's state; none if it published none.
  std::optional<StoredExistence> existence;
};

/// The id of a map's landmark number `counter`, from 1.
constexpr model::LandmarkId landmark_id(std::uint32_t map_id, std::uint64_t counter) {
  return (model::LandmarkId{map_id} << model::kLandmarkCounterBits) | counter;
}

/// Whether an id is possible for a landmark of the map: assigned by it, or by an earlier map.
bool is_id_of(model::LandmarkId id, std::uint32_t map_id);

/// Sets a map's state of existence and the probabilities of its landmarks; states of other
/// landmarks are left out.
void give_existence(StoredMap& map, const StoredExistence& existence);

/// Fault of a map, with the landmark or keyframe (a number that is not finite, a covariance that is
/// not positive semidefinite, an id of another map, ids not ascending); empty = no fault. O(size).
std::string fault_of(const StoredMap& map);
/// The same for one landmark of the map.
std::string fault_of(const StoredLandmark& landmark, std::uint32_t map_id);
/// The same for one keyframe.
std::string fault_of(const model::KeyframePose& pose);

}  // namespace understory::map_file
