// Checks a fitted stem against all beams that should hit it.
#pragma once

#include "services/landmark_extractor/rings/ring_cloud.hpp"
#include "services/landmark_extractor/trunks/column_fit.hpp"

namespace understory::landmark_extractor::trunks {

/// Results of the beams that should hit a stem, counted in rings.
struct StemProbe {
  int on = 0;               ///< Hits on the stem.
  int beside = 0;           ///< Hits on another object at about the distance of the stem.
  int through = 0;          ///< Return from behind it, or no return.
  bool open_above = false;  ///< Beams pass above it, where the stem should continue.
  bool open_below = false;  ///< Likewise below it.
};

/// Checks the stem over its fitted height, and between knee height and above a person's height,
/// where every trunk must be visible. `ground_z`: below the stem, frame `vehicle_level` [m].
StemProbe probe_stem(const rings::RingCloud& cloud, const StemFit& fit, double ground_z,
                     const SweepParameters& parameters);

}  // namespace understory::landmark_extractor::trunks
