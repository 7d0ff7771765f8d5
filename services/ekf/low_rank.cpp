#include "services/ekf/low_rank.hpp"

#include <Eigen/Cholesky>

#include "services/ekf/subtract_product.hpp"

namespace understory::ekf {

LowRank::LowRank(int max_size)
    : cross_(Eigen::MatrixXd::Zero(padded(max_size), kMaxRows)),
      gain_(Eigen::MatrixXd::Zero(padded(max_size), kMaxRows)),
      delta_(Eigen::VectorXd::Zero(max_size)),
      first_(Eigen::VectorXd::Zero(max_size)),
      second_(Eigen::VectorXd::Zero(max_size)) {}

double LowRank::apply_rows(FilterState& state, const double* innovation, const double* spread,
                           Eigen::Index stride, int rows) {
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxRows, kMaxRows>;
  using Column = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxRows, 1>;

  const Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>> spread_map(
      spread, rows, rows, Eigen::OuterStride<>(stride));
  const Eigen::LLT<Square> factor{Square(spread_map)};
  if (factor.info() != Eigen::Success) return -1.0;
  Column whitened = Eigen::Map<const Eigen::VectorXd>(innovation, rows);
  factor.matrixL().solveInPlace(whitened);

  // With spread = L L^T, gain = -cross L^-T: the covariance loses gain gain^T.
  Eigen::Matrix<double, kMaxRows, kMaxRows> inverse;
  inverse.setZero();
  inverse.topLeftCorner(rows, rows).diagonal().setOnes();
  factor.matrixL().solveInPlace(inverse.topLeftCorner(rows, rows));

  const int n = state.size();
  const int columns = padded(rows);
  cross_.middleRows(n, padded(n) - n).leftCols(rows).setZero();
  gain_.topLeftCorner(padded(n), columns).setZero();

  const Panel gain{gain_.data(), gain_.outerStride()};
  const ConstPanel gain_read{gain_.data(), gain_.outerStride()};
  subtract_product(gain, {cross_.data(), cross_.outerStride()}, {inverse.data(), kMaxRows}, n, rows,
                   rows, false);
  delta(n).noalias() -= gain_.topLeftCorner(n, rows) * whitened;
  subtract_product(state.covariance_panel(), gain_read, gain_read, n, n, rows, true);
  return whitened.squaredNorm();
}

}  // namespace understory::ekf
