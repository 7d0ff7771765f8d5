// Candidates of a detector compared with the query in detail.
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

/// A place that may be where the query is.
struct FoundPlace {
  std::uint64_t keyframe = 0;  ///< Of the place.
  geometry::SE2WithCovariance place_T_query;
  std::size_t pairs = 0;  ///< Stems of the query that the place has.
  /// Most pairs of a candidate that puts the query elsewhere; where the detector gives no evidence.
  std::size_t rival_pairs = 0;
  /// What the detector knows of it; none where pairs are all that speaks for it.
  std::optional<place_recognition::PlaceEvidence> evidence = std::nullopt;
};

/// A place as place recognition takes it.
place_recognition::PlaceFrame frame_of(const Place& place);

/// Verifies what a detector found. A detector whose score is a probability has found the pose
/// itself: the verifier must agree with it, as a second opinion. Of all others the verifier gives
/// the pose, and the correspondence graph must agree where another one was chosen: counts of Hough,
/// the likelihood of stems and the share of partners in clouds do not hold from one forest to the
/// next (docs/decisions/101). Scan Context finds a heading and no place: the graph's pose counts.
class PlaceVerification {
 public:
  /// Precondition: fault_of() finds nothing wrong with the choice, and it has a verifier.
  PlaceVerification(const SearchParameters& search, bool has_evidence,
                    const place_recognition::VerifierParameters& parameters);

  /// How many candidates it takes.
  std::size_t candidates() const { return candidates_; }
  /// Those that hold, most pairs first; of a detector with evidence its first one, or none. Cost:
  /// one comparison for each candidate.
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
  std::unique_ptr<place_recognition::PlaceVerifier> graph_;  ///< That must agree; may be none.
};

}  // namespace understory::loop_closer
