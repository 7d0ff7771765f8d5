#include "services/geoslam_mapper/smoothing/few_matches.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Probability of chi^2 below which pairs and guess are taken to disagree.
constexpr double kDisagree = 1e-3;
/// Probability of this number of pairs by chance, above which they are no evidence.
constexpr double kByChance = 1e-2;

/// sum of x^k / k! for k < n.
double exponential_part(double x, std::size_t n) {
  double term = 1.0;
  double sum = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    sum += term;
    term *= x / static_cast<double>(k + 1);
  }
  return sum;
}

/// Probability that chi^2 with 2 n degrees of freedom is larger.
double survival(double chi2, std::size_t n) {
  return std::exp(-0.5 * chi2) * exponential_part(0.5 * chi2, n);
}

/// Errors of the unambiguous pairs and of the guess, at the pose found. The guess has as many
/// dimensions as the pose, so each pair adds its two.
double chi2_of(const MatchedScan& scan) {
  const geometry::SE2& pose = scan.found.reference_T_observed;
  const Eigen::Vector3d off = (scan.guess.mean.inverse() * pose).Log();
  double chi2 = off.dot(scan.guess.covariance.inverse() * off);
  for (const geometry::PointPair& pair : scan.found.pairs) {
    if (pair.ambiguous) continue;
    const geometry::UncertainPoint& a = scan.reference[pair.reference];
    const geometry::UncertainPoint& b = scan.observed[pair.observed];
    const double variance = a.variance_m2 + b.variance_m2;
    chi2 += (a.position_m - pose * b.position_m).squaredNorm() / std::max(variance, 1e-12);
  }
  return chi2;
}

/// Expected number of observed points with a landmark in their gates by chance: from the landmarks'
/// density and the gates' areas before the matches.
double expected_by_chance(const MatchedScan& scan, const geometry::RegistrationParameters& gating,
                          double reach_m) {
  const double area_m2 = std::numbers::pi * reach_m * reach_m;
  const double density = static_cast<double>(scan.reference.size()) / area_m2;
  double of_reference = 0.0;
  for (const geometry::UncertainPoint& one : scan.reference) of_reference += one.variance_m2;
  of_reference /= static_cast<double>(std::max<std::size_t>(scan.reference.size(), 1));

  const Eigen::Matrix3d& covariance = scan.guess.covariance;
  double expected = 0.0;
  for (const geometry::UncertainPoint& one : scan.observed) {
    const double of_pose = std::max(covariance(0, 0), covariance(1, 1)) +
                           one.position_m.squaredNorm() * covariance(2, 2);
    const double gate_m =
        std::min(gating.max_gate_m,
                 gating.gate_floor_m +
                     gating.gate_sigmas * std::sqrt(one.variance_m2 + of_reference + of_pose));
    expected += std::min(1.0, density * std::numbers::pi * gate_m * gate_m);
  }
  return expected;
}

}  // namespace

std::size_t count_clear(std::span<const geometry::PointPair> pairs) {
  return static_cast<std::size_t>(
      std::ranges::count_if(pairs, [](const geometry::PointPair& one) { return !one.ambiguous; }));
}

bool adds_to_odometry(const MatchedScan& scan, const geometry::RegistrationParameters& gating,
                      double reach_m) {
  const std::size_t clear = count_clear(scan.found.pairs);
  if (clear == 0 || survival(chi2_of(scan), clear) < kDisagree) return false;
  const double expected = expected_by_chance(scan, gating, reach_m);
  return 1.0 - std::exp(-expected) * exponential_part(expected, clear) < kByChance;
}

}  // namespace understory::geoslam_mapper::smoothing
