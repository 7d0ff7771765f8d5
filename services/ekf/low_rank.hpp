// A Kalman update of the whole state by a few rows of measurement.
#pragma once

#include <Eigen/Core>

#include "services/ekf/filter_state.hpp"

namespace understory::ekf {

/// Most rows of measurement in one step.
inline constexpr int kMaxRows = 32;

/// Low-rank Kalman steps, with their memory allocated once. A measurement fills cross(), then calls
/// apply() for up to kMaxRows rows; the correction of all steps since start() is delta().
class LowRank {
 public:
  /// For states of up to `max_size` rows.
  explicit LowRank(int max_size);

  /// Covariance of the state's error with the innovation, size x rows; the caller fills it.
  auto cross(int size, int rows) { return cross_.topLeftCorner(size, rows); }
  /// Sum of the corrections of the state's error since start() (`size` numbers).
  auto delta(int size) { return delta_.head(size); }
  /// Begins a measurement of a state of `size` rows: no correction yet.
  void start(int size) { delta_.head(size).setZero(); }
  /// A vector of `size` numbers for the caller's intermediate results.
  auto first(int size) { return first_.head(size); }
  /// Another one.
  auto second(int size) { return second_.head(size); }

  /// Adds the correction by `innovation` (one number per row, without the part already corrected by
  /// delta()) with covariance `spread` (lower triangle), reduces the state's covariance, and
  /// returns the squared Mahalanobis distance of the innovation; returns a negative number, without
  /// change, if `spread` is not positive definite. O(size^2 rows).
  template <typename Innovation, typename Spread>
  double apply(FilterState& state, const Innovation& innovation, const Spread& spread) {
    return apply_rows(state, innovation.data(), spread.data(), spread.outerStride(),
                      static_cast<int>(innovation.size()));
  }

 private:
  double apply_rows(FilterState& state, const double* innovation, const double* spread,
                    Eigen::Index stride, int rows);

  Eigen::MatrixXd cross_;
  Eigen::MatrixXd gain_;
  Eigen::VectorXd delta_;
  Eigen::VectorXd first_;
  Eigen::VectorXd second_;
};

}  // namespace understory::ekf
