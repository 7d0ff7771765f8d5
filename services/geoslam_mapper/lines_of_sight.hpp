// Whether what a keyframe should have seen was hidden, or is not there.
#pragma once

#include <deque>
#include <span>

#include "common/model/archive.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/map.hpp"
#include "common/model/view_ranges.hpp"

namespace understory::geoslam_mapper {

/// Keeps VIEW_RANGES of the last sweeps until the keyframe comes that was made of them.
class LinesOfSight {
 public:
  /// The next sweep's.
  void add(const model::ViewRanges& ranges);

  /// Fills in what the keyframe's scans measured along the rays to what they should have seen. One
  /// is blocked, or clear, where half of the scans with ranges say so and none says the opposite.
  /// `landmarks`: of the map, in order of id.
  void fill(const model::Keyframe& keyframe, std::span<const model::MapLandmark> landmarks,
            model::MapUpdate& update) const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.ranges_);
  }

 private:
  static constexpr std::size_t kKept = 32;  ///< Sweeps; a keyframe is made of 8 or fewer.

  std::deque<model::ViewRanges> ranges_;  ///< In the order in which they came.
};

}  // namespace understory::geoslam_mapper
