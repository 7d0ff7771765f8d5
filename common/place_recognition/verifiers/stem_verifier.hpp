// The likelihood of all stems as a verifier of two frames.
#pragma once

#include <optional>
#include <span>

#include "common/place_recognition/place_verifier.hpp"

namespace understory::place_recognition::verifiers {

/// Start poses are from common triangles of both frames, and from guesses with a sigma below a
/// metre; the likelihood of all stems (stem_likelihood.hpp) decides. The score is the natural
/// logarithm of the likelihood ratio against random stems. Needs no guess.
class StemVerifier final : public PlaceVerifier {
 public:
  /// Uses `stems`, `triangles` and `max_distance_m`.
  explicit StemVerifier(const VerifierParameters& parameters) : parameters_(parameters) {}

  std::optional<VerifiedPlace> verify(
      const PlaceFrame& query, const PlaceFrame& frame,
      std::span<const geometry::SE2WithCovariance> guesses) const override;

 private:
  VerifierParameters parameters_;
};

}  // namespace understory::place_recognition::verifiers
