// A stored map as parts that move as wholes: its submaps, and pieces of the ground beside them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

#include "common/map_file/stored_map.hpp"
#include "common/model/submap.hpp"

namespace understory::map_closure {

/// Why a closure cannot be made; one line for a person.
class ClosureError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A submap, or a piece of the path that the mapper held itself when the drive ended.
struct Part {
  model::SubmapId submap = 0;  ///< 0: a piece of the ground.
  /// The mapper held it when the drive ended, ground or a submap that had come back: covariances
  /// are of the whole map. Those of others are relative to the submap.
  bool is_held = true;
  geometry::SE2 map_T_part;  ///< As the layers show it.
  /// Of its first keyframe, or of the nearest one where it has none [us].
  model::Utime utime = 0;
  std::vector<std::uint32_t> keyframes;  ///< Places in StoredMap::keyframes, in order of time.
  std::vector<std::uint32_t> landmarks;  ///< Places in StoredMap::landmarks.
};

/// The parts of a map in order of time; each keyframe and each landmark is in one of them. A piece
/// of the ground is 20 m of path at most. A landmark of the ground belongs to the piece whose
/// keyframe is nearest, or, where none is within 40 m, to the part whose is. Throws ClosureError
/// where the map has no submaps. Cost: landmarks of the ground times keyframes.
std::vector<Part> parts_of(const map_file::StoredMap& map, std::span<const model::Submap> submaps);

}  // namespace understory::map_closure
