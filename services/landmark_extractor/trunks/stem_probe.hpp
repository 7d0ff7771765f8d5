// What the beams say about a stem that was fitted to some of them.
#pragma once

#include "services/landmark_extractor/rings/ring_cloud.hpp"
#include "services/landmark_extractor/trunks/column_fit.hpp"

namespace understory::landmark_extractor::trunks {

/// What the beams that should meet a stem met, counted in rings.
struct StemProbe {
  int on = 0;               ///< The stem.
  int beside = 0;           ///< Something else at about the distance of the stem.
  int through = 0;          ///< Nothing: they went on to something behind, or to nowhere.
  bool open_above = false;  ///< Beams pass where the stem should go on upwards.
  bool open_below = false;  ///< The same downwards.
};

/// Looks at the stem as far as it was fitted, and where everything that stands must be: from
/// knee height to above a person's.
StemProbe probe_stem(const rings::RingCloud& cloud, const StemFit& fit, double ground_z,
                     const SweepParameters& parameters);

}  // namespace understory::landmark_extractor::trunks
