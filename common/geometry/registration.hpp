// Registration of a small set of points to a reference set, from an uncertain guess.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"

namespace understory::geometry {

/// A point with isotropic position noise. Its frame is the frame of its set.
struct UncertainPoint {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double variance_m2 = 0.0;  ///< Variance per axis.
  /// Added to the squared Mahalanobis distance when the candidates inside a gate are ranked, so
  /// that doubtful points are paired last. Dimensionless.
  double reluctance = 0.0;
};

/// One observed point and the reference point paired with it.
struct PointPair {
  std::uint32_t reference = 0;  ///< Index in the reference set.
  std::uint32_t observed = 0;   ///< Index in the observed set.
  bool ambiguous = false;       ///< Another point lies inside the gate as well.
};

/// Limits of a registration.
struct RegistrationParameters {
  double gate_sigmas = 4.0;    ///< Half width of the association gate, in standard deviations.
  double gate_floor_m = 0.03;  ///< Added to the gate for errors that the noise model lacks.
  double max_gate_m = 4.0;     ///< A point with a wider gate waits until the pose is better known.
  int max_rounds = 12;         ///< Largest number of pairing and fitting rounds.
};

/// Result of a registration: the pose, its covariance and its pairs.
struct Registration {
  SE2 reference_T_observed;
  /// Covariance of reference_T_observed (order x, y, theta; right perturbation; m, rad). It
  /// includes the information of the guess.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::vector<PointPair> pairs;  ///< One to one, in order of `observed`.
};

/// How many pairs a registration needs before its pose is accepted.
struct MatchQuota {
  std::size_t min_matched = 4;     ///< Least number of pairs.
  double min_matched_ratio = 0.5;  ///< Least share of the points that can be matched, 0 to 1.

  /// True where `matched` pairs are enough, if `possible` points can be matched.
  bool is_met(std::size_t matched, std::size_t possible) const {
    return share_is_met(matched, possible) && matched >= min_matched;
  }

  /// Tests the share alone, for callers that replace the least number by another condition.
  bool share_is_met(std::size_t matched, std::size_t possible) const {
    return static_cast<double>(matched) >= min_matched_ratio * static_cast<double>(possible);
  }

  /// The same quota for a scene with `available` points: it never needs more pairs than that.
  MatchQuota capped_at(std::size_t available) const {
    return {std::min(min_matched, available), min_matched_ratio};
  }
};

/// Registers `observed` (frame `observed`) to `reference` (frame `reference`), starting from
/// `guess` (reference_T_observed with its covariance). Where either set is empty the guess comes
/// back without pairs.
///
/// The gate of each pair follows from the points' variances and from the pose covariance, which
/// shrinks from round to round. While the gate is wide, only points with a single candidate inside
/// it are used, so near points determine the heading before far points are used.
///
/// Cost O(m log m + rounds * n) for m reference and n observed points, wherever they are and
/// whatever their variances: a round skips a point with more than 128 reference points around its
/// gate, and all candidates after the first 65,536. No real scene reaches these limits.
Registration register_points(std::span<const UncertainPoint> reference,
                             std::span<const UncertainPoint> observed,
                             const SE2WithCovariance& guess,
                             const RegistrationParameters& parameters = {});

/// Uncertainty of the motion between two observations when no odometry measures it.
struct StepModel {
  double sigma_m = 0.3;  ///< Standard deviation of the translation, per axis.
  /// Standard deviation of the rotation; also the step width of the search.
  double sigma_rad = 0.04;
  double max_rotation_rad = 0.5;  ///< Largest rotation that is searched, to either side.
  /// Least number of pairs of a searched rotation. Four points fit one of 27 rotations by chance.
  std::size_t min_searched_pairs = 8;
};

/// Registers an observation that was made one step after the pose `last` (reference_T_observed).
///
/// The first guess repeats `last_step` (previous_T_last). Where its result does not satisfy `fits`,
/// rotations on the spot from -max_rotation_rad to max_rotation_rad are tried, and the result with
/// the most pairs is returned. That result may not satisfy `fits` either: the caller must check. Of
/// more than 256 observed points the rotations are tried with the nearest 256, and the best one is
/// registered with all. Cost: that of two calls of register_points(), and of one with at most 256
/// points and 8,192 candidates for each rotation where the first guess fails.
Registration register_step(std::span<const UncertainPoint> reference,
                           std::span<const UncertainPoint> observed, const SE2& last,
                           const SE2& last_step, const StepModel& model,
                           const RegistrationParameters& parameters,
                           const std::function<bool(const Registration&)>& fits);

}  // namespace understory::geometry
