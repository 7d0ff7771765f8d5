// Registration of a small set of points to a reference, from an uncertain guess.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"

namespace understory::geometry {

/// A point with isotropic position variance [m^2].
struct UncertainPoint {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double variance_m2 = 0.0;
  /// Added to the squared Mahalanobis distance when candidates inside a gate are ranked: doubtful
  /// points come second.
  double reluctance = 0.0;
};

struct PointPair {
  std::uint32_t reference = 0;
  std::uint32_t observed = 0;
  bool ambiguous = false;  ///< Another point lies inside the gate as well.
};

struct RegistrationParameters {
  double gate_sigmas = 4.0;    ///< Half width of the association gate, in standard deviations.
  double gate_floor_m = 0.03;  ///< Added to it: what the noise model does not know.
  double max_gate_m = 4.0;     ///< Points with a wider gate wait until the pose is better known.
  int max_rounds = 12;
};

struct Registration {
  SE2 reference_T_observed;
  /// Of reference_T_observed (right perturbation), the guess' information included.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::vector<PointPair> pairs;  ///< One to one, in order of `observed`.
};

/// Registers `observed` (frame `observed`) to `reference` (frame `reference`) starting from `guess`
/// with its covariance.
///
/// The gate of each pair follows from the points' variances and from the pose's own uncertainty,
/// which shrinks from round to round; while it is wide, only points with a single candidate inside
/// their gate count. So near points fix the heading before far ones are used. Cost O(rounds (n +
/// m)).
Registration register_points(std::span<const UncertainPoint> reference,
                             std::span<const UncertainPoint> observed,
                             const SE2WithCovariance& guess,
                             const RegistrationParameters& parameters = {});

/// What is known of the step between two observations when nothing measures it.
struct StepModel {
  double sigma_m = 0.3;
  double sigma_rad = 0.04;
  double max_rotation_rad = 0.5;  ///< Largest turn that is searched.
  /// A turn that was searched needs so many pairs: among 27 tried, four points fit one by chance.
  std::size_t min_searched_pairs = 8;
};

/// Registers an observation made one step after `last` (pose in `reference`). First the last step
/// is taken to repeat; where the result does not `fit`, turns on the spot are tried from -max_turn
/// to max_turn, and the one with the most pairs, if they are enough, is returned, fitting or not.
Registration register_step(std::span<const UncertainPoint> reference,
                           std::span<const UncertainPoint> observed, const SE2& last,
                           const SE2& last_step, const StepModel& model,
                           const RegistrationParameters& parameters,
                           const std::function<bool(const Registration&)>& fits);

}  // namespace understory::geometry
