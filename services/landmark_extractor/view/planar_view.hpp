// How far a laser that scans one plane saw.
#pragma once

#include "common/model/view_ranges.hpp"
#include "services/landmark_extractor/planar/beams.hpp"

namespace understory::landmark_extractor::view {

/// A bin for each step from beam to beam, in order of time, from the first beam to the last; no
/// bins where the step is not known. Of the returns of one bin the nearest is how far one sees, and
/// from the farthest on all is hidden. A beam without a return says nothing. Ranges up to
/// `range_m`. Stamp and number are left to the caller.
model::ViewRanges planar_view(const planar::Beams& scan, double range_m);

}  // namespace understory::landmark_extractor::view
