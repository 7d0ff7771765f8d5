#include "common/place_recognition/verifiers/stem_verifier.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/place_recognition/hypotheses.hpp"
#include "common/place_recognition/stem_likelihood.hpp"
#include "common/place_recognition/stem_triangles.hpp"

namespace understory::place_recognition::verifiers {
namespace {

/// Largest number of poses to refine, those with the most triangles first.
constexpr std::size_t kMostStarts = 8;
/// A guess with a larger sigma is no start, because the likelihood has many peaks [m], [rad].
constexpr double kKnownM = 1.0;
constexpr double kKnownRad = 0.1;
/// Largest distance of a reported pair [m].
constexpr double kGateM = 0.4;

/// Start poses of the search.
std::vector<geometry::SE2> starts_of(std::span<const LevelStem> query,
                                     std::span<const LevelStem> frame,
                                     std::span<const geometry::SE2WithCovariance> guesses,
                                     const VerifierParameters& parameters) {
  HypothesisFilter filter;
  filter.max_distance_m = parameters.max_distance_m;
  TripletIndex index(filter.side_tolerance_m);
  index.add(frame, stem_triangles(frame, parameters.triangles));
  const auto alike = index.hypotheses(query, stem_triangles(query, parameters.triangles), filter);
  std::vector<PlaceCluster> clusters;
  collect_clusters(alike, clusters);
  std::stable_sort(clusters.begin(), clusters.end(),
                   [](const auto& a, const auto& b) { return a.votes > b.votes; });

  std::vector<geometry::SE2> starts;
  for (const PlaceCluster& cluster : clusters) {
    if (starts.size() < kMostStarts) starts.push_back(cluster.frame_T_query);
  }
  for (const geometry::SE2WithCovariance& guess : guesses) {
    const Eigen::Vector3d variance = guess.covariance.diagonal();
    if (variance.head<2>().maxCoeff() < kKnownM * kKnownM && variance.z() < kKnownRad * kKnownRad)
      starts.push_back(guess.mean);
  }
  return starts;
}

}  // namespace

std::optional<VerifiedPlace> StemVerifier::verify(
    const PlaceFrame& query, const PlaceFrame& frame,
    std::span<const geometry::SE2WithCovariance> guesses) const {
  const std::vector<LevelStem> of_query = PackedStems(level_stems(query)).unpacked();
  std::vector<LevelStem> of_frame = PackedStems(level_stems(frame)).unpacked();
  if (of_query.size() < 3 || of_frame.size() < 3) return std::nullopt;

  const auto starts = starts_of(of_query, of_frame, guesses, parameters_);
  DiameterStatistics diameters;
  for (const LevelStem& stem : of_frame) diameters.add(stem.diameter_m);
  const StemLikelihood likelihood(view_of(std::move(of_frame)), parameters_.stems,
                                  diameters.spread());
  double best_ratio = -std::numeric_limits<double>::infinity();
  geometry::SE2 best;
  for (const geometry::SE2& start : starts) {
    const geometry::SE2 pose = likelihood.refined(of_query, start);
    if (!(pose.translation().norm() <= parameters_.max_distance_m)) continue;
    const double ratio = likelihood.log_ratio(of_query, pose);
    if (ratio > best_ratio) {
      best_ratio = ratio;
      best = pose;
    }
  }
  if (!std::isfinite(best_ratio)) return std::nullopt;

  const auto pairs = likelihood.pairs(of_query, best, kGateM);
  return VerifiedPlace{best, likelihood.covariance(of_query, best, pairs), best_ratio,
                       pairs.size()};
}

}  // namespace understory::place_recognition::verifiers
