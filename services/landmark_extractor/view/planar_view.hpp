// Range of view of a one-plane laser.
#pragma once

#include "common/model/view_ranges.hpp"
#include "services/landmark_extractor/planar/beams.hpp"

namespace understory::landmark_extractor::view {

/// A bin per beam step, in order of time, from the first beam to the last; no bins if the step is
/// unknown. The nearest return of a bin gives the visible range, the farthest one the range from
/// which everything is hidden. A beam without a return is ignored. Ranges up to `range_m`. The
/// caller sets stamp and number.
model::ViewRanges planar_view(const planar::Beams& scan, double range_m);

}  // namespace understory::landmark_extractor::view
