// A Kalman update of the whole state by a few rows of measurement.
#pragma once

#include <Eigen/Core>

#include "services/ekf/filter_state.hpp"

namespace understory::ekf {

/// Rows of measurement that one low-rank step takes at most.
inline constexpr int kMaxRows = 32;

/// Room for low-rank steps, made once.
class LowRank {
 public:
  explicit LowRank(int max_size);

  /// Covariance of the state's error with the innovation, to be filled by the caller: size x rows.
  auto cross(int size, int rows) { return cross_.topLeftCorner(size, rows); }
  /// Correction gathered since start().
  auto delta(int size) { return delta_.head(size); }
  void start(int size) { delta_.head(size).setZero(); }
  /// Two vectors for whoever needs them in between.
  auto first(int size) { return first_.head(size); }
  auto second(int size) { return second_.head(size); }

  /// Adds the correction by `innovation` (rows numbers; what delta() says already taken out) with
  /// covariance `spread` (lower triangle), takes what was learned out of the state's covariance,
  /// and gives the squared Mahalanobis distance of the innovation; a negative number, and nothing
  /// changed, where `spread` is not positive definite.
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
