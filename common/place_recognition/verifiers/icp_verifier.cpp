#include "common/place_recognition/verifiers/icp_verifier.hpp"

#include <vector>

namespace understory::place_recognition::verifiers {
namespace {

/// Fewer points do not determine a pose.
constexpr std::size_t kLeastPoints = 5;

}  // namespace

std::optional<VerifiedPlace> IcpVerifier::verify(
    const PlaceFrame& query, const PlaceFrame& frame,
    std::span<const geometry::SE2WithCovariance> guesses) const {
  const std::vector<Eigen::Vector3f> of_query = points_of(query);
  const std::vector<Eigen::Vector3f> of_frame = points_of(frame);
  if (of_query.size() < kLeastPoints || of_frame.size() < kLeastPoints) return std::nullopt;

  const IcpCloud moving(of_query, parameters_.icp);
  const IcpCloud fixed(of_frame, parameters_.icp);
  std::vector<geometry::SE2> starts;
  starts.reserve(guesses.size() + 1);
  for (const geometry::SE2WithCovariance& guess : guesses) starts.push_back(guess.mean);
  if (starts.empty()) starts.emplace_back();

  std::optional<VerifiedPlace> best;
  for (const geometry::SE2& start : starts) {
    const IcpResult found = icp(moving, fixed, metric_, start, parameters_.icp);
    const double share = static_cast<double>(found.inliers) / static_cast<double>(moving.size());
    const geometry::SE2& pose = found.frame_T_query.plane;
    if (!(pose.translation().norm() <= parameters_.max_distance_m)) continue;
    if (found.inliers < kLeastPoints || (best && share <= best->score)) continue;
    best = VerifiedPlace{pose, found.covariance, share, found.inliers};
  }
  return best;
}

}  // namespace understory::place_recognition::verifiers
