// One scan's landmarks against the filter's map.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "services/ekf/filter_state.hpp"
#include "services/ekf/low_rank.hpp"

namespace understory::ekf {

/// An observation, seen from the vehicle.
struct Observation {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();
  /// Above the vehicle's origin, as the level displaces it; 0 = no level took part.
  double height_m = 0.0;
};

/// The innovation of a sighting of landmark i, in the axes of the map, depends on the errors of the
/// landmark and of the position as +1 and -1, and on the heading's as this (zero if right
/// invariant).
Eigen::Vector2d heading_row(const FilterState& state, std::size_t landmark);
/// On the level's error as this.
Eigen::Matrix2d level_rows(const FilterState& state, double height_m);
/// Innovation of a sighting: where it lies less where the landmark is expected [m], axes of the
/// map.
Eigen::Vector2d innovation(const FilterState& state, std::size_t landmark, const Observation& seen);
/// Covariance of the innovations of landmarks a and b that the state's uncertainty makes; seen at
/// these heights.
Eigen::Matrix2d innovation_covariance(const FilterState& state, std::size_t a, std::size_t b,
                                      double height_a_m = 0.0, double height_b_m = 0.0);
/// Squared Mahalanobis distance of one sighting.
double squared_distance(const FilterState& state, std::size_t landmark, const Observation& seen);

struct Pairing {
  std::uint32_t observation = 0;
  std::uint32_t landmark = 0;
};

/// The joint Kalman update of one scan. Done in steps of a few landmarks at one linearisation,
/// which gives what one large step would (the map is linear) at half its cost.
class JointUpdate {
 public:
  explicit JointUpdate(int max_landmarks);

  /// Updates the state by all pairings; gives the squared Mahalanobis distance of all innovations
  /// together, or a negative number where the covariance is not positive definite. The estimate
  /// itself is moved by finish() only.
  double apply(FilterState& state, std::span<const Observation> observations,
               std::span<const Pairing> pairings, LowRank& room);
  void finish(FilterState& state, LowRank& room) { state.retract(room.delta(state.size())); }

 private:
  double apply_some(FilterState& state, std::span<const Observation> observations,
                    std::span<const Pairing> pairings, LowRank& room);

  Eigen::MatrixXd vehicle_;  ///< Covariance of the state with (heading, position, level).
};

}  // namespace understory::ekf
