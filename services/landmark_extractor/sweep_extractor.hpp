// Finds the landmarks in one turn of a laser that scans in space.
#pragma once

#include <cstdint>
#include <vector>

#include "common/model/landmarks.hpp"
#include "common/model/point_sweep.hpp"
#include "services/landmark_extractor/corners/sweep_corners.hpp"
#include "services/landmark_extractor/ground/ground_surface.hpp"
#include "services/landmark_extractor/parameters.hpp"
#include "services/landmark_extractor/rings/ring_runs.hpp"
#include "services/landmark_extractor/trunks/sweep_trunks.hpp"

namespace understory::landmark_extractor {

/// What came in and what became of it; counted for HEALTH.
struct SweepCounters {
  std::uint64_t sweeps = 0;
  std::uint64_t malformed = 0;         ///< No rings, not de-skewed, numbers that are none.
  std::uint64_t without_attitude = 0;  ///< Taken as level.
  rings::PointCounters points;
  std::uint64_t on_wall = 0;  ///< Trunks that were pieces of a wall.
  trunks::TrunkCounters trunks;
  corners::CornerCounters corners;
};

/// Keeps its working memory from sweep to sweep.
class SweepExtractor {
 public:
  explicit SweepExtractor(const LandmarkExtractorParameters& parameters)
      : sweep_(parameters.sweep),
        trunks_(parameters.sweep, parameters.trunk),
        corners_(parameters.sweep, parameters.corner) {}

  /// A malformed sweep gives no detections. Invariant: trunks first, each kind in order of bearing.
  model::LandmarkScan extract(const model::PointSweep& sweep);
  const SweepCounters& counters() const { return counters_; }

 private:
  SweepParameters sweep_;
  ground::GroundSample sample_;
  rings::RingCloud cloud_;
  ground::GroundSurface ground_;
  std::vector<rings::Run> runs_;
  trunks::SweepTrunks trunks_;
  corners::SweepCorners corners_;
  SweepCounters counters_;
};

}  // namespace understory::landmark_extractor
