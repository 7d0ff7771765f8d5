// A map as it is stored: what a map file holds for one map number.
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

/// A landmark with what the map's keepers know of it. The map number in its id is its map's, or
/// that of an earlier map which became part of it.
struct StoredLandmark {
  model::MapLandmark landmark;             ///< Frame `map`.
  std::optional<std::uint64_t> submap_id;  ///< The submap that holds it.
  std::optional<double> existence;         ///< Probability that it is still there, 0 to 1.
};

/// Where a submap lies, frame `map`.
struct SubmapBorder {
  std::uint64_t submap_id = 0;
  std::vector<Eigen::Vector2d> corners_m;  ///< Three or more; the last one is not the first again.
};

/// Two keyframes between which a loop was closed.
struct LoopClosure {
  std::uint64_t from_sequence = 0;  ///< KeyframePose::keyframe_sequence.
  std::uint64_t to_sequence = 0;
  Eigen::Vector2d from_m = Eigen::Vector2d::Zero();  ///< Their places, frame `map`.
  Eigen::Vector2d to_m = Eigen::Vector2d::Zero();
};

/// One map. Stored and read again it is equal to the bit, but that covariances come back symmetric
/// and -0.0 as 0.0.
struct StoredMap {
  /// 1 to kLastMapId; upper 16 bit of its landmarks' ids. Those of maps that became part of it have
  /// the smaller numbers of these.
  std::uint32_t map_id = 1;
  std::string name;                       ///< For people; may be empty.
  model::Utime created_utime = 0;         ///< Of what it was made from, or when it was made [us].
  std::string origin;                     ///< What it was made from, e.g. the name of a log.
  std::vector<StoredLandmark> landmarks;  ///< In order of id.
  std::vector<model::KeyframePose> keyframes;  ///< In order of time.
  std::vector<SubmapBorder> submap_borders;
  std::vector<LoopClosure> loop_closures;
  /// What the existence tracker goes on with; none where it never said.
  std::optional<StoredExistence> existence;
};

/// The id of a map's landmark number `counter`, from 1.
constexpr model::LandmarkId landmark_id(std::uint32_t map_id, std::uint64_t counter) {
  return (model::LandmarkId{map_id} << model::kLandmarkCounterBits) | counter;
}

/// Whether an id is one that a landmark of the map can have: given by it, or by an earlier map.
bool is_id_of(model::LandmarkId id, std::uint32_t map_id);

/// Gives a map what is known of its landmarks' existence, their probabilities too; what is of other
/// landmarks is left out.
void give_existence(StoredMap& map, const StoredExistence& existence);

/// What a map cannot have in it, with the landmark or keyframe (a number that is not finite, a
/// covariance that is not positive semidefinite, an id of another map, ids that do not ascend);
/// empty where nothing is wrong. O(size).
std::string fault_of(const StoredMap& map);
/// The same of one landmark of the map.
std::string fault_of(const StoredLandmark& landmark, std::uint32_t map_id);
/// The same of one keyframe.
std::string fault_of(const model::KeyframePose& pose);

}  // namespace understory::map_file
