// Lines of sight: whether an expected landmark was occluded or its place was seen empty.
#pragma once

#include <deque>
#include <span>

#include "common/model/archive.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/map.hpp"
#include "common/model/view_ranges.hpp"

namespace understory::geoslam_mapper {

/// Keeps VIEW_RANGES of the last sweeps until the keyframe of these sweeps arrives.
class LinesOfSight {
 public:
  /// Adds the next sweep's ranges.
  void add(const model::ViewRanges& ranges);

  /// Sets the line of sight of each landmark that the keyframe expected: blocked or clear if half
  /// of the scans with ranges say so and none says the opposite. `landmarks`: of the map, in order
  /// of id.
  void fill(const model::Keyframe& keyframe, std::span<const model::MapLandmark> landmarks,
            model::MapUpdate& update) const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.ranges_);
  }

 private:
  static constexpr std::size_t kKept = 32;  ///< Sweeps; a keyframe is made of 8 or fewer.

  std::deque<model::ViewRanges> ranges_;  ///< In order of arrival.
};

}  // namespace understory::geoslam_mapper
