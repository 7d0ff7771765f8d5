#include "eval/experiments/closures/plane_chain.hpp"

#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <algorithm>

namespace understory::eval::experiments::closures {
namespace {

using geometry::SE2;
using Triplets = std::vector<Eigen::Triplet<double>>;

/// Normal equations of relative poses; the first pose has no columns.
struct Normal {
  Triplets entries;
  Eigen::VectorXd right;

  void put(std::size_t row, std::size_t column, const Eigen::Matrix3d& block) {
    if (row == 0 || column == 0) return;
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k)
        entries.emplace_back(3 * static_cast<int>(row - 1) + i,
                             3 * static_cast<int>(column - 1) + k, block(i, k));
  }
  void add(const std::vector<SE2>& poses, std::size_t a, std::size_t b, const SE2& a_T_b,
           const Eigen::Matrix3d& information) {
    const SE2 between = poses[a].inverse() * poses[b];
    const Eigen::Vector3d residual = (a_T_b.inverse() * between).Log();
    const Eigen::Matrix3d by_b = geometry::inverse_right_jacobian(residual);
    const Eigen::Matrix3d by_a = -by_b * between.inverse().Adjoint();
    put(a, a, by_a.transpose() * information * by_a);
    put(a, b, by_a.transpose() * information * by_b);
    put(b, a, by_b.transpose() * information * by_a);
    put(b, b, by_b.transpose() * information * by_b);
    if (a > 0)
      right.segment<3>(3 * static_cast<int>(a - 1)) -= by_a.transpose() * information * residual;
    if (b > 0)
      right.segment<3>(3 * static_cast<int>(b - 1)) -= by_b.transpose() * information * residual;
  }
};

}  // namespace

PlaneChain::PlaneChain(std::vector<SE2> steps, const Eigen::Matrix3d& covariance)
    : steps_(std::move(steps)), information_(covariance.inverse()) {
  reckoned_.emplace_back();
  spread_.emplace_back(Eigen::Matrix3d::Zero());
  for (const SE2& step : steps_) {
    reckoned_.push_back(reckoned_.back() * step);
    const Eigen::Matrix3d adjoint = reckoned_.back().Adjoint();
    spread_.emplace_back(spread_.back() + adjoint * covariance * adjoint.transpose());
  }
  poses_ = reckoned_;
}

double PlaneChain::step(const std::vector<WeightedClosure>& closures) {
  Normal normal;
  const int size = 3 * static_cast<int>(steps_.size());
  normal.right = Eigen::VectorXd::Zero(size);
  for (std::size_t i = 0; i < steps_.size(); ++i)
    normal.add(poses_, i, i + 1, steps_[i], information_);
  for (const WeightedClosure& one : closures)
    if (one.weight > 0.0)
      normal.add(poses_, one.a, one.b, one.a_T_b.mean, one.weight * one.a_T_b.covariance.inverse());

  Eigen::SparseMatrix<double> matrix(size, size);
  matrix.setFromTriplets(normal.entries.begin(), normal.entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(matrix);
  const Eigen::VectorXd change = factors.solve(normal.right);
  for (std::size_t i = 1; i < poses_.size(); ++i)
    poses_[i] = poses_[i] * SE2::Exp(change.segment<3>(3 * static_cast<int>(i - 1)));
  return change.cwiseAbs().maxCoeff();
}

void PlaneChain::solve(const std::vector<WeightedClosure>& closures, int rounds) {
  for (int round = 0; round < rounds; ++round)
    if (step(closures) < 1e-4) return;
}

double PlaneChain::chi2(const WeightedClosure& closure) const {
  const SE2 between = poses_[closure.a].inverse() * poses_[closure.b];
  const Eigen::Vector3d off = (closure.a_T_b.mean.inverse() * between).Log();
  return off.dot(closure.a_T_b.covariance.inverse() * off);
}

geometry::SE2WithCovariance PlaneChain::odometry(std::size_t a, std::size_t b) const {
  if (a > b) return inverse(odometry(b, a));
  const Eigen::Matrix3d into = reckoned_[b].inverse().Adjoint();
  return {reckoned_[a].inverse() * reckoned_[b],
          into * (spread_[b] - spread_[a]) * into.transpose()};
}

}  // namespace understory::eval::experiments::closures
