#include "services/ekf/low_rank.hpp"

#include <Eigen/Cholesky>

namespace understory::ekf {

double LowRank::apply_rows(FilterState& state, const double* innovation, const double* spread,
                           Eigen::Index stride, int rows) {
  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxRows, kMaxRows>;
  using Row = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxRows, 1>;
  const Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>> spread_map(
      spread, rows, rows, Eigen::OuterStride<>(stride));
  const Eigen::LLT<Small> factor{Small(spread_map)};
  if (factor.info() != Eigen::Success) return -1.0;
  auto gain = cross(state.size(), rows);
  // With spread = L L^T, gain = cross L^-T: the covariance loses gain gain^T.
  factor.matrixL().transpose().solveInPlace<Eigen::OnTheRight>(gain);
  Row whitened = Eigen::Map<const Eigen::VectorXd>(innovation, rows);
  factor.matrixL().solveInPlace(whitened);
  delta(state.size()).noalias() += gain * whitened;
  auto covariance = state.covariance();
  covariance.selfadjointView<Eigen::Lower>().rankUpdate(gain, -1.0);
  return whitened.squaredNorm();
}

}  // namespace understory::ekf
