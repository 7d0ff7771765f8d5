// Finds the landmarks in one sweep.
#pragma once

#include <cstdint>

#include "common/model/landmarks.hpp"
#include "common/model/planar_scan.hpp"
#include "services/landmark_extractor/parameters.hpp"

namespace understory {

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
      : parameters_(parameters) {}

  /// Trunks of a one-plane laser: objects that stand alone, are round, and have a trunk's size.
  /// A malformed scan gives none. Invariant: detections are in order of bearing.
  LandmarkScan extract(const PlanarScan& scan);
  const ExtractorCounters& counters() const { return counters_; }

 private:
  LandmarkExtractorParameters parameters_;
  ExtractorCounters counters_;
};

}  // namespace understory
