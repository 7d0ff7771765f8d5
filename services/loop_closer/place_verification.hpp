// Detailed comparison of a detector's candidates with the query.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/place_recognition/place_detector.hpp"
#include "common/place_recognition/place_verifier.hpp"
#include "services/loop_closer/parameters.hpp"
#include "services/loop_closer/place_memory.hpp"

namespace understory::loop_closer {

/// A place that may be the query's place.
struct FoundPlace {
  std::uint64_t keyframe = 0;  ///< Of the place.
  geometry::SE2WithCovariance place_T_query;
  std::size_t pairs = 0;  ///< Stems of the query with a partner in the place.
  /// Most pairs of a candidate with another pose of the query; only if the detector gives no
  /// evidence.
  std::size_t rival_pairs = 0;
  /// The detector's evidence; none if the pairs are the only evidence.
  std::optional<place_recognition::PlaceEvidence> evidence = std::nullopt;
};

/// Converts a place to the input of place recognition.
place_recognition::PlaceFrame frame_of(const Place& place);

/// Verifies candidates of a detector. A detector whose score is a probability gives the pose
/// itself: the verifier must agree with it. For all other detectors the verifier gives the pose,
/// and if the chosen verifier is not the correspondence graph, the graph must agree: thresholds of
/// Hough counts, of stem likelihood and of the share of partners in clouds differ between forests
/// (docs/decisions/101). Scan Context gives a heading but no position: then the graph's pose is
/// used.
class PlaceVerification {
 public:
  /// Precondition: fault_of() returns no fault, and the choice has a verifier.
  PlaceVerification(const SearchParameters& search, bool has_evidence,
                    const place_recognition::VerifierParameters& parameters);

  /// Number of candidates that it verifies.
  std::size_t candidates() const { return candidates_; }
  /// The verified candidates, most pairs first; with a detector's evidence only its first one, or
  /// none. Cost: one comparison per candidate.
  std::vector<FoundPlace> verified(const place_recognition::PlaceFrame& query,
                                   std::span<const place_recognition::ScoredPlace> scored,
                                   const PlaceMemory& memory) const;

 private:
  std::optional<FoundPlace> compared(const place_recognition::PlaceFrame& query,
                                     const place_recognition::ScoredPlace& scored,
                                     const Place& place) const;
  bool is_enough(const place_recognition::VerifiedPlace& verified) const;

  std::size_t candidates_;
  std::size_t least_pairs_;
  std::optional<double> least_score_;  ///< Of a verifier that compares clouds.
  std::unique_ptr<place_recognition::PlaceVerifier> verifier_;
  std::unique_ptr<place_recognition::PlaceVerifier> graph_;  ///< Must agree; may be null.
};

}  // namespace understory::loop_closer
