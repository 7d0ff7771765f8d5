// Scan Context as a verifier: it needs no landmarks.
#pragma once

#include <optional>
#include <span>

#include "common/place_recognition/detectors/scan_context.hpp"
#include "common/place_recognition/place_verifier.hpp"

namespace understory::place_recognition::verifiers {

/// One minus the distance of two frames' contexts (thesis 002 §6.3: independent of landmarks). The
/// pose has the heading of the best shift, and the translation of the root shift alone, with
/// standard deviation `place_sigma_m`. It counts no inliers. Needs no guess.
class ScanContextVerifier final : public PlaceVerifier {
 public:
  /// Uses `scan_context` and `place_sigma_m`.
  explicit ScanContextVerifier(const VerifierParameters& parameters)
      : maker_(parameters.scan_context), place_sigma_m_(parameters.place_sigma_m) {}

  std::optional<VerifiedPlace> verify(
      const PlaceFrame& query, const PlaceFrame& frame,
      std::span<const geometry::SE2WithCovariance> guesses) const override;

 private:
  detectors::ScanContextMaker maker_;
  double place_sigma_m_;
};

}  // namespace understory::place_recognition::verifiers
