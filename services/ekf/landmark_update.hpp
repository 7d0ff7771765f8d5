// Comparison of one scan's landmarks with the filter's map.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "services/ekf/filter_state.hpp"
#include "services/ekf/low_rank.hpp"

namespace understory::ekf {

/// A landmark as observed from the vehicle (frame `vehicle_level`, in the plane).
struct Observation {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();
  /// Above the vehicle's origin; the level error displaces the observation by it; 0 = without
  /// effect of the level.
  double height_m = 0.0;
};

/// Jacobian of the innovation (axes of the map) of `landmark` with respect to the heading's error;
/// zero for right invariant errors. With respect to the errors of the landmark and of the position
/// it is +1 and -1.
Eigen::Vector2d heading_row(const FilterState& state, std::size_t landmark);
/// The same with respect to the level's error, of an observation at `height_m`.
Eigen::Matrix2d level_rows(const FilterState& state, double height_m);
/// Observed less expected position of `landmark` [m], axes of the map.
Eigen::Vector2d innovation(const FilterState& state, std::size_t landmark,
                           const Observation& observation);
/// Covariance between the innovations of landmarks a and b, observed at these heights, from the
/// state's uncertainty alone [m^2], without the observations' noise.
Eigen::Matrix2d innovation_covariance(const FilterState& state, std::size_t a, std::size_t b,
                                      double height_a_m = 0.0, double height_b_m = 0.0);
/// Squared Mahalanobis distance of one innovation, the observation's noise included.
double squared_distance(const FilterState& state, std::size_t landmark,
                        const Observation& observation);

/// An observation of a landmark, both by index.
struct Pairing {
  std::uint32_t observation = 0;
  std::uint32_t landmark = 0;
};

/// The joint Kalman update of one scan, in steps of 16 landmarks at one linearisation: the same
/// result as a single large step (the map is linear) at half its cost.
class JointUpdate {
 public:
  /// Allocates for states of up to `max_landmarks`.
  explicit JointUpdate(int max_landmarks);

  /// Updates the covariance by all pairings and sums up the correction in `low_rank`; returns the
  /// joint squared Mahalanobis distance of all innovations, or a negative number if their
  /// covariance is not positive definite (the state's covariance may then have changed in part).
  /// Only finish() moves the estimate. O(size^2) per step.
  double apply(FilterState& state, std::span<const Observation> observations,
               std::span<const Pairing> pairings, LowRank& low_rank);
  /// Moves the estimate by the correction from apply().
  void finish(FilterState& state, LowRank& low_rank) {
    state.retract(low_rank.delta(state.size()));
  }

 private:
  double apply_some(FilterState& state, std::span<const Observation> observations,
                    std::span<const Pairing> pairings, LowRank& low_rank);

  Eigen::MatrixXd vehicle_;  ///< Covariance of the state with (heading, position, level).
};

}  // namespace understory::ekf
