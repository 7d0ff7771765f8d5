#include "common/map_merge/pairing.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <tuple>

#include "common/constellation/chance.hpp"

namespace understory::map_merge {
namespace {

/// A landmark is in the area of the other map if that has this many landmarks ...
constexpr std::size_t kCovering = 6;
/// ... within this many times its usual distance between neighbours.
constexpr double kCoveringSpacings = 2.5;
/// Pairs that determine a motion: they are no evidence for it.
constexpr double kPairsOfMotion = 3.0;

double covering_radius(const LandmarkSet& set) { return kCoveringSpacings * set.spacing_m(); }

/// For each landmark of `set`, moved into the frame of `other`: whether it lies in the area of
/// `other`.
std::vector<bool> inside(const LandmarkSet& set, const geometry::SE2& other_T_set,
                         const LandmarkSet& other) {
  std::vector<bool> result;
  result.reserve(set.all().size());
  for (const UncertainLandmark& one : set.all()) {
    const Eigen::Vector2d there = other_T_set * one.position_m;
    result.push_back(other.count_within(there, covering_radius(other)) >= kCovering);
  }
  return result;
}

std::size_t number_of(const std::vector<bool>& flags) {
  return static_cast<std::size_t>(std::ranges::count(flags, true));
}

/// Landmarks of both maps that may be the same.
struct Candidate {
  double chi2 = 0.0;
  std::uint32_t first = 0;
  std::uint32_t second = 0;
  double distance_m = 0.0;
};

class PairSearch {
 public:
  PairSearch(const LandmarkSet& first, const LandmarkSet& second, const DifferenceModel& model,
             const AlignmentParameters& parameters)
      : first_(first), second_(second), model_(model), parameters_(parameters) {
    for (const UncertainLandmark& one : first.all())
      largest_m2_ = std::max(largest_m2_, one.covariance_m2.trace());
  }

  /// Adds the candidates of the landmark; returns the expected number of landmarks in its gate by
  /// chance.
  double collect(std::uint32_t second, std::vector<Candidate>& candidates) const {
    const UncertainLandmark& one = second_.all()[second];
    const Eigen::Vector2d at = model_.first_T_second * one.position_m;
    const double widest_m2 = model_.scale * (one.covariance_m2.trace() + largest_m2_) + floor_m2();
    const double radius_m =
        std::min(parameters_.max_gate_m, parameters_.gate_sigmas * std::sqrt(widest_m2));
    first_.grid().for_each_within(at.x(), at.y(), radius_m,
                                  [&](constellation::Slot slot, double /*squared*/) {
                                    consider(slot, second, at, candidates);
                                  });
    return chance_at(one, at);
  }

 private:
  double floor_m2() const { return parameters_.gate_floor_m * parameters_.gate_floor_m; }
  Eigen::Matrix2d covariance(const UncertainLandmark& first,
                             const UncertainLandmark& second) const {
    return model_.independent(first, second) + floor_m2() * Eigen::Matrix2d::Identity();
  }

  void consider(std::uint32_t first, std::uint32_t second, const Eigen::Vector2d& at,
                std::vector<Candidate>& candidates) const {
    const UncertainLandmark& landmark = first_.all()[first];
    if (landmark.kind != second_.all()[second].kind) return;
    const Eigen::Vector2d off = landmark.position_m - at;
    const Eigen::Matrix2d sum = covariance(landmark, second_.all()[second]);
    const double chi2 = off.dot(sum.inverse() * off);
    if (!(chi2 <= parameters_.gate_sigmas * parameters_.gate_sigmas)) return;
    candidates.push_back({chi2, first, second, off.norm()});
  }

  /// Expected landmarks in the gate if the surrounding ones were uniformly distributed.
  double chance_at(const UncertainLandmark& one, const Eigen::Vector2d& at) const {
    const double radius_m = covering_radius(first_);
    const auto around = static_cast<double>(first_.count_within(at, radius_m));
    const double gate_m2 = parameters_.gate_sigmas * parameters_.gate_sigmas *
                           std::sqrt(std::max(0.0, covariance(one, one).determinant()));
    const double widest_m2 = parameters_.max_gate_m * parameters_.max_gate_m;
    return around * std::min(gate_m2, widest_m2) / (radius_m * radius_m);
  }

  const LandmarkSet& first_;
  const LandmarkSet& second_;
  const DifferenceModel& model_;
  const AlignmentParameters& parameters_;
  double largest_m2_ = 0.0;  ///< Largest variance of the first map's landmarks, sum of both axes.
};

/// Selects pairs, the best first, each landmark once.
std::vector<LandmarkPair> one_to_one(std::vector<Candidate> candidates, const LandmarkSet& first,
                                     const LandmarkSet& second) {
  std::ranges::sort(candidates, [](const Candidate& a, const Candidate& b) {
    return std::tie(a.chi2, a.second, a.first) < std::tie(b.chi2, b.second, b.first);
  });
  std::vector<bool> first_taken(first.all().size(), false);
  std::vector<bool> second_taken(second.all().size(), false);

  std::vector<LandmarkPair> pairs;
  for (const Candidate& one : candidates) {
    if (first_taken[one.first] || second_taken[one.second]) continue;
    first_taken[one.first] = true;
    second_taken[one.second] = true;
    pairs.push_back({one.first, one.second, one.distance_m, one.chi2});
  }
  std::ranges::sort(pairs, {}, &LandmarkPair::second);
  return pairs;
}

}  // namespace

double Pairing::share() const {
  const std::size_t possible = std::min(first_in_overlap, second_in_overlap);
  if (possible == 0) return 0.0;
  return std::min(1.0, static_cast<double>(pairs_in_overlap) / static_cast<double>(possible));
}

Eigen::Matrix<double, 2, 3> DifferenceModel::jacobian(const UncertainLandmark& second) const {
  const Eigen::Matrix2d rotation = first_T_second.rotation();
  Eigen::Matrix<double, 2, 3> jacobian;
  jacobian << rotation, rotation * geometry::perpendicular(second.position_m - centre_m);
  return jacobian;
}

Eigen::Matrix2d DifferenceModel::stated(const UncertainLandmark& first,
                                        const UncertainLandmark& second) const {
  const Eigen::Matrix2d rotation = first_T_second.rotation();
  return first.covariance_m2 + rotation * second.covariance_m2 * rotation.transpose();
}

Eigen::Matrix2d DifferenceModel::independent(const UncertainLandmark& first,
                                             const UncertainLandmark& second) const {
  const Eigen::Matrix<double, 2, 3> by_motion = jacobian(second);
  const Eigen::Matrix2d left = stated(first, second) - by_motion * common * by_motion.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(0.5 * (left + left.transpose()));
  const Eigen::Vector2d variances = solver.eigenvalues().cwiseMax(least_m2);
  return scale *
         (solver.eigenvectors() * variances.asDiagonal() * solver.eigenvectors().transpose());
}

Pairing pair_up(const LandmarkSet& first, const LandmarkSet& second, const DifferenceModel& model,
                const AlignmentParameters& parameters) {
  const PairSearch search(first, second, model, parameters);
  const std::vector<bool> is_shared = inside(second, model.first_T_second, first);
  std::vector<Candidate> candidates;
  double chance = 0.0;
  for (std::uint32_t i = 0; i < is_shared.size(); ++i) {
    // A sparse area may also have a pair; it is no evidence for the motion.
    const double expected = search.collect(i, candidates);
    if (is_shared[i]) chance += std::min(1.0, expected);
  }

  Pairing pairing;
  pairing.pairs = one_to_one(std::move(candidates), first, second);
  pairing.second_in_overlap = number_of(is_shared);
  pairing.first_in_overlap = number_of(inside(first, model.first_T_second.inverse(), second));
  pairing.pairs_in_overlap = static_cast<std::size_t>(std::ranges::count_if(
      pairing.pairs, [&](const LandmarkPair& pair) { return is_shared[pair.second]; }));
  const auto tries = static_cast<double>(pairing.second_in_overlap);
  const double hits = static_cast<double>(pairing.pairs_in_overlap) - kPairsOfMotion;
  if (hits <= 0.0) return pairing;
  pairing.log10_tail =
      constellation::log10_binomial_tail_bound(hits, tries - kPairsOfMotion, chance / tries);
  return pairing;
}

}  // namespace understory::map_merge
