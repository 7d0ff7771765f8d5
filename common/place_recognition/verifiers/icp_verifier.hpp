// ICP as a verifier of two frames.
#pragma once

#include <optional>
#include <span>

#include "common/place_recognition/place_verifier.hpp"
#include "common/place_recognition/verifiers/icp.hpp"

namespace understory::place_recognition::verifiers {

/// Runs ICP from each guess (from the identity without one) and takes the result with the largest
/// share of query points with a partner within `inlier_m`; this share is the score. For frames
/// without a cloud, the landmarks are the points.
class IcpVerifier final : public PlaceVerifier {
 public:
  /// Uses `icp` and `max_distance_m`.
  IcpVerifier(IcpMetric metric, const VerifierParameters& parameters)
      : metric_(metric), parameters_(parameters) {}

  std::optional<VerifiedPlace> verify(
      const PlaceFrame& query, const PlaceFrame& frame,
      std::span<const geometry::SE2WithCovariance> guesses) const override;

 private:
  IcpMetric metric_;
  VerifierParameters parameters_;
};

}  // namespace understory::place_recognition::verifiers
