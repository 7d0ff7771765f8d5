// Distinguishes a stem from a strip of a wall.
#pragma once

#include <vector>

#include "services/landmark_extractor/parameters.hpp"
#include "services/landmark_extractor/trunks/stem_terms.hpp"

namespace understory::landmark_extractor::trunks {

/// Comparison of an upright plane and a stem for the same hits.
struct PlaneComparison {
  double width_m = 0.0;      ///< Of the hits along the plane.
  double flat_excess = 0.0;  ///< chi^2 of the plane minus that of the stem.
};

/// Fits a plane by total least squares. A strip of a wall resembles a thick stem of which little is
/// seen; then the excess is negative. Precondition: at least one hit, at most `kMaxRuns` groups.
PlaneComparison compare_with_plane(const std::vector<HitLanes>& hits, const StemState& stem,
                                   const BeamNoise& noise, const SweepParameters& sweep,
                                   const SweepTrunkParameters& trunk);

}  // namespace understory::landmark_extractor::trunks
