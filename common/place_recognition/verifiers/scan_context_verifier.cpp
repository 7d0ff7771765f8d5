#include "common/place_recognition/verifiers/scan_context_verifier.hpp"

#include "common/place_recognition/detectors/linear_detector.hpp"

namespace understory::place_recognition::verifiers {

std::optional<VerifiedPlace> ScanContextVerifier::verify(
    const PlaceFrame& query, const PlaceFrame& frame,
    std::span<const geometry::SE2WithCovariance> /*guesses*/) const {
  const auto contexts = detectors::shifted_contexts(maker_, query);
  const auto context = maker_.describe(points_of(frame), Eigen::Vector2d::Zero());
  if (contexts.empty() || !context) return std::nullopt;

  const detectors::BestContext best = detectors::best_context(maker_, contexts, *context);
  const auto guess = detectors::heading_guess(best.frame_T_query, place_sigma_m_,
                                              maker_.heading_sigma_rad(place_sigma_m_));
  return VerifiedPlace{guess.mean, guess.covariance, 1.0 - best.distance, 0};
}

}  // namespace understory::place_recognition::verifiers
