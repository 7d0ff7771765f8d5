// Self-similarity of places, as in the rows of a plantation.
#pragma once

#include <span>

#include "common/place_recognition/level_stems.hpp"
#include "common/place_recognition/stem_likelihood.hpp"

namespace understory::loop_closer {

/// Decades of likelihood with which the stems of a place fit the same place shifted by 1 to 12 m:
/// the evidence that a wrong pose can have in rows of stems. 0 if no shift fits. The shifts tested
/// are the most frequent differences between two stems. Cost: quadratic in the stems, some
/// milliseconds for 80.
double self_likeness(std::span<const place_recognition::LevelStem> stems,
                     const place_recognition::StemNoise& noise);

}  // namespace understory::loop_closer
