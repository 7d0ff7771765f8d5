// Whether the beams agree with a stem that was fitted to some of them.
#pragma once

#include "services/landmark_extractor/rings/ring_cloud.hpp"
#include "services/landmark_extractor/trunks/column_fit.hpp"

namespace understory::landmark_extractor::trunks {

/// What those beams met that should meet a stem, counted in rings.
struct StemProbe {
  int on = 0;               ///< The stem.
  int beside = 0;           ///< Something else at about the distance of the stem.
  int through = 0;          ///< Nothing there: something behind it, or no return.
  bool open_above = false;  ///< Beams pass where the stem should go on upwards.
  bool open_below = false;  ///< The same downwards.
};

/// Looks at the stem as far as it was fitted, and between knee height and above a person's height,
/// where every trunk must be. `ground_z`: below the stem, frame `vehicle_level` [m].
StemProbe probe_stem(const rings::RingCloud& cloud, const StemFit& fit, double ground_z,
                     const SweepParameters& parameters);

}  // namespace understory::landmark_extractor::trunks
