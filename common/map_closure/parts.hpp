// A stored map as rigid parts: its submaps, and pieces of the ground outside of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

#include "common/map_file/stored_map.hpp"
#include "common/model/submap.hpp"

namespace understory::map_closure {

/// The reason why a closure cannot be made; one line of text.
class ClosureError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A submap, or a piece of the path that was in the mapper's memory at the end of the drive.
struct Part {
  model::SubmapId submap = 0;  ///< 0 = a piece of the ground.
  /// It was in the mapper's memory at the end of the drive (ground, or a submap taken back):
  /// covariances are relative to the map. For other parts they are relative to the submap.
  bool is_held = true;
  geometry::SE2 map_T_part;  ///< As in the layers.
  /// Stamp of its first keyframe, or of the nearest one if it has none [us].
  model::Utime utime = 0;
  std::vector<std::uint32_t> keyframes;  ///< Indices in StoredMap::keyframes, in order of time.
  std::vector<std::uint32_t> landmarks;  ///< Indices in StoredMap::landmarks.
};

/// The parts of a map in order of time; each keyframe and each landmark is in one of them. A piece
/// of the ground has at most 20 m of path. A landmark of the ground belongs to the piece with the
/// nearest keyframe or, if none is within 40 m, to the part with the nearest keyframe. Throws
/// ClosureError where the map has no submaps. Cost: landmarks of the ground times keyframes.
std::vector<Part> parts_of(const map_file::StoredMap& map, std::span<const model::Submap> submaps);

}  // namespace understory::map_closure
