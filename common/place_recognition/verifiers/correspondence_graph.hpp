// Associates landmarks by the largest set of pairs with consistent distances.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "common/place_recognition/landmark_pairs.hpp"
#include "common/place_recognition/place_verifier.hpp"
#include "common/place_recognition/verifiers/max_clique.hpp"

namespace understory::place_recognition::verifiers {

/// A vertex for each pair of a query's and a frame's landmark (whose diameters, where both are
/// known, differ by less than the tolerance); an edge where the distance between the two query
/// landmarks equals that between the two frame landmarks within tau (thesis 002 eq. 2.33). No edge
/// between pairs that share a landmark.
struct CorrespondenceGraph {
  std::vector<LandmarkPair> pairs;  ///< Pair of each vertex.
  VertexGraph graph{0};
};
/// O(query^2 * frame^2).
CorrespondenceGraph correspondence_graph(const LandmarkSets& landmarks,
                                         const CorrespondenceGraphParameters& parameters);

/// The largest clique of the correspondence graph (Rizzini 2015; thesis 002 §2.4.2) and the motion
/// that aligns its pairs. Distances do not distinguish a place from its mirror image; pairs beyond
/// tau after the motion are dropped. The score is the number of remaining pairs. Needs no guess.
class CorrespondenceGraphVerifier final : public PlaceVerifier {
 public:
  /// Uses `graph`, `sigma_m` and `max_distance_m`.
  explicit CorrespondenceGraphVerifier(const VerifierParameters& parameters)
      : parameters_(parameters) {}

  std::optional<VerifiedPlace> verify(
      const PlaceFrame& query, const PlaceFrame& frame,
      std::span<const geometry::SE2WithCovariance> guesses) const override;

 private:
  VerifierParameters parameters_;
};

/// The result of a verifier for a pose by pairs, with their number as score. None with fewer than
/// three pairs or beyond `max_distance_m`.
std::optional<VerifiedPlace> place_by_pairs(const LandmarkSets& landmarks, const PairedPose& pose,
                                            const VerifierParameters& parameters);

}  // namespace understory::place_recognition::verifiers
