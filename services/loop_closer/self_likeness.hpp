// Places that look like themselves some metres on: rows of a plantation.
#pragma once

#include <span>

#include "common/place_recognition/level_stems.hpp"
#include "common/place_recognition/stem_likelihood.hpp"

namespace understory::loop_closer {

/// Decades of likelihood with which the stems of a place fit the place itself, shifted by 1 to
/// 12 m: so much a wrong pose can show where stems stand in rows. 0 where no shift fits. Shifts
/// tried are the most frequent differences between two stems. Cost: quadratic in the stems, some
/// milliseconds for 80.
double self_likeness(std::span<const place_recognition::LevelStem> stems,
                     const place_recognition::StemNoise& noise);

}  // namespace understory::loop_closer
