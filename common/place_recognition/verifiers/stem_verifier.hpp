// The likelihood of all stems as a verifier of two frames.
#pragma once

#include <optional>
#include <span>

#include "common/place_recognition/place_verifier.hpp"

namespace understory::place_recognition::verifiers {

/// Triangles that both frames have give poses, and so do guesses that are known to a metre; the
/// likelihood of all stems (stem_likelihood.hpp) decides. The score is the natural logarithm of the
/// likelihood over that of stems that lie anywhere. Needs no guess.
class StemVerifier final : public PlaceVerifier {
 public:
  /// Takes `stems`, `triangles` and `max_distance_m`.
  explicit StemVerifier(const VerifierParameters& parameters) : parameters_(parameters) {}

  std::optional<VerifiedPlace> verify(
      const PlaceFrame& query, const PlaceFrame& frame,
      std::span<const geometry::SE2WithCovariance> guesses) const override;

 private:
  VerifierParameters parameters_;
};

}  // namespace understory::place_recognition::verifiers
