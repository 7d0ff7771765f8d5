// Finds the landmarks in one sweep.
#pragma once

#include <cstdint>

#include "common/model/landmarks.hpp"
#include "common/model/planar_scan.hpp"
#include "services/landmark_extractor/parameters.hpp"
#include "services/landmark_extractor/sweep_extractor.hpp"

namespace understory::landmark_extractor {

/// Why objects did not become landmarks; counted for HEALTH.
struct ExtractorCounters {
  std::uint64_t scans = 0;
  std::uint64_t scans_malformed = 0;  ///< No beams, or angles that make no sense.
  std::uint64_t objects = 0;
  std::uint64_t too_few_points = 0;
  std::uint64_t not_alone = 0;  ///< Something beside it at about the same distance.
  std::uint64_t out_of_range = 0;
  std::uint64_t not_round = 0;  ///< No circle fits, or one of the wrong size.
  std::uint64_t landmarks = 0;
};

class LandmarkExtractor {
 public:
  explicit LandmarkExtractor(const LandmarkExtractorParameters& parameters = {})
      : parameters_(parameters), sweeps_(parameters) {}

  /// Trunks of a one-plane laser: objects that stand alone, are round, and have a trunk's size.
  /// A malformed scan gives none. Invariant: detections are in order of bearing.
  model::LandmarkScan extract(const model::PlanarScan& scan);
  /// Trunks and corners of a laser that scans in space.
  model::LandmarkScan extract(const model::PointSweep& sweep) { return sweeps_.extract(sweep); }
  const ExtractorCounters& counters() const { return counters_; }
  const SweepCounters& sweep_counters() const { return sweeps_.counters(); }

 private:
  LandmarkExtractorParameters parameters_;
  ExtractorCounters counters_;
  SweepExtractor sweeps_;
};

}  // namespace understory::landmark_extractor
