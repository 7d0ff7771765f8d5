#include "services/associator/scan_localiser.hpp"

#include <algorithm>
#include <cmath>

#include "common/geometry/alignment.hpp"
#include "services/associator/consistent_set.hpp"
#include "services/associator/match.hpp"

namespace understory::associator {
namespace {

/// Least size of a consistent set.
constexpr std::size_t kMinConsistent = 3;
/// Variance of the heading [rad^2] by a consistent set, before the refinement.
constexpr double kSearchedHeadingVariance = 0.01;

std::vector<geometry::UncertainPoint> reference_points(std::span<const Track> tracks,
                                                       model::LandmarkKind kind) {
  std::vector<geometry::UncertainPoint> points;
  for (const Track& track : tracks) {
    if (track.kind != kind || track.steadiness == Steadiness::kMoves) continue;
    points.push_back(
        {track.position_m, track.variance_m2(), track.observations < kYoung ? kReluctance : 0.0});
  }
  return points;
}

std::vector<geometry::UncertainPoint> observed_points(std::span<const Observation> observations,
                                                      model::LandmarkKind kind) {
  std::vector<geometry::UncertainPoint> points;
  for (const Observation& one : observations) {
    if (one.kind == kind) points.push_back({one.position_m, one.variance_m2()});
  }
  return points;
}

template <class Points>
std::vector<ConsistencyPoint> consistency_points(const Points& points) {
  std::vector<ConsistencyPoint> result;
  for (const auto& point : points) {
    result.push_back({point.position_m, point.variance_m2(), static_cast<int>(point.kind)});
  }
  return result;
}

class ScanLocaliser {
 public:
  ScanLocaliser(std::span<const Track> tracks, std::span<const Observation> observations,
                const model::FieldOfView& view, const AssociatorParameters& parameters)
      : tracks_(tracks), observations_(observations), view_(view), parameters_(parameters) {
    registration_.gate_sigmas = parameters.gate_sigmas;
  }

  /// Refines a pose by trunks, then by corners; the pairs of both are counted.
  geometry::Registration refine(const geometry::SE2WithCovariance& guess) const {
    geometry::Registration result{guess.mean, guess.covariance, {}};
    for (const model::LandmarkKind kind :
         {model::LandmarkKind::kTrunk, model::LandmarkKind::kCorner}) {
      geometry::Registration part =
          register_points(reference_points(tracks_, kind), observed_points(observations_, kind),
                          {result.reference_T_observed, result.covariance}, registration_);
      result.reference_T_observed = part.reference_T_observed;
      result.covariance = part.covariance;
      result.pairs.insert(result.pairs.end(), part.pairs.begin(), part.pairs.end());
    }
    return result;
  }

  bool fits(const geometry::Registration& pose) const {
    const geometry::SE2 vehicle_T_local = pose.reference_T_observed.inverse();
    std::size_t in_view = 0;
    std::size_t confirmed = 0;  // Tracks with two observations or more.
    for (const Track& track : tracks_) {
      if (track.steadiness == Steadiness::kMoves) continue;
      if (!view_.contains(vehicle_T_local * track.position_m)) continue;
      ++in_view;
      if (track.observations >= 2) ++confirmed;
    }

    const std::size_t matchable = confirmed > 0 ? confirmed : in_view;
    const geometry::MatchQuota quota{static_cast<std::size_t>(parameters_.min_matched),
                                     parameters_.min_matched_ratio};
    return quota.capped_at(std::min(observations_.size(), in_view))
        .is_met(pose.pairs.size(), std::min(observations_.size(), matchable));
  }

  /// The pose by the largest consistent set, refined; the guess if there is no such set.
  geometry::Registration search(const geometry::SE2WithCovariance& guess) const {
    const auto reference = consistency_points(tracks_);
    const auto observed = consistency_points(observations_);
    const auto pairs = consistent_set(reference, observed, guess.mean, gate(guess));
    if (pairs.size() < kMinConsistent) return {guess.mean, guess.covariance, {}};

    geometry::RigidAlignment2 alignment;
    double variance = 0.0;
    for (const ConsistencyPair& pair : pairs) {
      const ConsistencyPoint& a = reference[pair.reference];
      const ConsistencyPoint& b = observed[pair.observed];
      alignment.add(a.position_m, b.position_m, 1.0 / (a.variance_m2 + b.variance_m2));
      variance = std::max(variance, a.variance_m2 + b.variance_m2);
    }
    const Eigen::Matrix3d covariance =
        Eigen::Vector3d(variance, variance, kSearchedHeadingVariance).asDiagonal();
    return refine({alignment.a_T_b(), covariance});
  }

 private:
  ConsistencyGate gate(const geometry::SE2WithCovariance& guess) const {
    const double sigma = std::sqrt(guess.covariance.topLeftCorner<2, 2>().trace());
    ConsistencyGate gate;
    gate.sigmas = parameters_.gate_sigmas;
    gate.shift_m = std::max(parameters_.motion_sigma_m, sigma) * parameters_.gate_sigmas;
    gate.rotation_rad = parameters_.max_rotation_rad;
    return gate;
  }

  std::span<const Track> tracks_;
  std::span<const Observation> observations_;
  const model::FieldOfView& view_;
  const AssociatorParameters& parameters_;
  geometry::RegistrationParameters registration_;
};

}  // namespace

Localisation locate(std::span<const Track> tracks, std::span<const Observation> observations,
                    const model::FieldOfView& view, const geometry::SE2WithCovariance& guess,
                    const AssociatorParameters& parameters) {
  if (parameters.method == "nearest") return {{guess.mean, guess.covariance, {}}};

  // The predicted pose, refined iteratively.
  const ScanLocaliser localiser(tracks, observations, view, parameters);
  geometry::Registration refined = localiser.refine(guess);
  const bool fits = localiser.fits(refined);
  const bool is_enough = parameters.method == "registered" || (parameters.method == "auto" && fits);
  if (is_enough) return {std::move(refined), fits, false};

  // The largest consistent set, if it gives more matches.
  geometry::Registration searched = localiser.search(guess);
  if (fits && searched.pairs.size() <= refined.pairs.size())
    return {std::move(refined), fits, true};
  const bool searched_fits = localiser.fits(searched);
  return {std::move(searched), searched_fits, true};
}

}  // namespace understory::associator
