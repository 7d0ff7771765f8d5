#include "common/map_merge/fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <vector>

namespace understory::map_merge {
namespace {

constexpr int kMostSteps = 20;
constexpr double kConverged = 1e-10;
/// Rounds of alternating estimation of motion and common part.
constexpr int kRounds = 4;
/// Variance of a difference, per axis, where covariances are singular [m^2].
constexpr double kLeast_m2 = 1e-6;
/// The same as a share of the mean residual of the pairs.
constexpr double kLeastShare = 0.1;

using Jacobian = Eigen::Matrix<double, 2, 3>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// The entries xx, xy, yy of J P J^T, linear in P's entries xx, xy, xt, yy, yt, tt.
Eigen::Matrix<double, 3, 6> rows_of(const Jacobian& jacobian) {
  Eigen::Matrix<double, 3, 6> rows;
  const auto fill = [&](int row, int a, int b) {
    int column = 0;
    for (int i = 0; i < 3; ++i) {
      for (int k = i; k < 3; ++k) {
        double value = jacobian(a, i) * jacobian(b, k);
        if (i != k) value += jacobian(a, k) * jacobian(b, i);
        rows(row, column++) = value;
      }
    }
  };
  fill(0, 0, 0);
  fill(1, 0, 1);
  fill(2, 1, 1);
  return rows;
}

/// Pairs relative to the mean of the second map's common landmarks: there translation and heading
/// are hardly correlated, at any distance from the frame's origin.
class PairFit {
 public:
  PairFit(const LandmarkSet& first, const LandmarkSet& second, std::span<const LandmarkPair> pairs,
          const geometry::SE2& start)
      : first_(first), second_(second), pairs_(pairs) {
    model_.first_T_second = start;
    model_.least_m2 = kLeast_m2;
    for (const LandmarkPair& pair : pairs) model_.centre_m += b(pair).position_m;
    model_.centre_m /= static_cast<double>(pairs.size());
  }

  MotionFit run() {
    solve();
    for (int round = 1; round < kRounds; ++round) {
      separate();
      solve();
    }
    linearise();
    model_.scale = freedom() > 0.0 ? chi2_ / freedom() : 1.0;
    return {covariance(), model_};
  }

 private:
  const UncertainLandmark& a(const LandmarkPair& pair) const { return first_.all()[pair.first]; }
  const UncertainLandmark& b(const LandmarkPair& pair) const { return second_.all()[pair.second]; }
  double freedom() const { return 2.0 * static_cast<double>(pairs_.size()) - 3.0; }
  Eigen::Vector2d left_m(const LandmarkPair& pair) const {
    return a(pair).position_m - model_.first_T_second * b(pair).position_m;
  }

  void solve() {
    const geometry::SE2 centre_T_second(Eigen::Vector2d(-model_.centre_m), 0.0);
    for (int step = 0; step < kMostSteps; ++step) {
      linearise();
      const Eigen::Vector3d xi = information_.ldlt().solve(gradient_);
      model_.first_T_second = model_.first_T_second * centre_T_second.inverse() *
                              geometry::SE2::Exp(xi) * centre_T_second;
      if (xi.norm() < kConverged) break;
    }
  }

  void linearise() {
    information_.setZero();
    gradient_.setZero();
    chi2_ = 0.0;
    for (const LandmarkPair& pair : pairs_) {
      const Jacobian jacobian = model_.jacobian(b(pair));
      const Eigen::Matrix2d weight = model_.independent(a(pair), b(pair)).inverse();
      const Eigen::Vector2d left = left_m(pair);
      information_ += jacobian.transpose() * weight * jacobian;
      gradient_ += jacobian.transpose() * weight * left;
      chi2_ += left.dot(weight * left);
    }
  }

  /// The residuals of the pairs are independent; the common motion's covariance P minimises the sum
  /// of |S - left - J P J^T|^2 over the stated covariances S. Negative parts are cut off.
  void separate() {
    if (!(freedom() > 0.0)) return;
    double squared = 0.0;
    for (const LandmarkPair& pair : pairs_) squared += left_m(pair).squaredNorm();
    const double left_m2 = squared / freedom();
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
    Vector6 right = Vector6::Zero();
    for (const LandmarkPair& pair : pairs_) {
      const auto rows = rows_of(model_.jacobian(b(pair)));
      const Eigen::Matrix2d stated = model_.stated(a(pair), b(pair));
      const Eigen::Vector3d rest(stated(0, 0) - left_m2, stated(0, 1), stated(1, 1) - left_m2);
      normal += rows.transpose() * rows;
      right += rows.transpose() * rest;
    }

    const Vector6 p = normal.completeOrthogonalDecomposition().solve(right);
    Eigen::Matrix3d common;
    common << p(0), p(1), p(2), p(1), p(3), p(4), p(2), p(4), p(5);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(common);
    model_.common = solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).asDiagonal() *
                    solver.eigenvectors().transpose();
    model_.least_m2 = std::max(kLeast_m2, kLeastShare * left_m2);
  }

  Eigen::Matrix3d covariance() const {
    const geometry::SE2 first_T_centre =
        model_.first_T_second * geometry::SE2(model_.centre_m, 0.0);
    const Eigen::Matrix3d about_centre = model_.scale * information_.inverse() + model_.common;
    const geometry::SE2 centre_T_second(Eigen::Vector2d(-model_.centre_m), 0.0);
    return geometry::compound({first_T_centre, about_centre}, {centre_T_second}).covariance;
  }

  const LandmarkSet& first_;
  const LandmarkSet& second_;
  std::span<const LandmarkPair> pairs_;
  DifferenceModel model_;
  Eigen::Matrix3d information_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient_ = Eigen::Vector3d::Zero();
  double chi2_ = 0.0;
};

}  // namespace

MotionFit fit_motion(const LandmarkSet& first, const LandmarkSet& second,
                     std::span<const LandmarkPair> pairs, const geometry::SE2& start) {
  return PairFit(first, second, pairs, start).run();
}

}  // namespace understory::map_merge
