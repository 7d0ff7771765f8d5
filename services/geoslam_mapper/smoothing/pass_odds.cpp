#include "services/geoslam_mapper/smoothing/pass_odds.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Least clutter [1/m^2]: 20 trunks on a hectare.
constexpr double kLeastClutter = 0.002;
constexpr int kFitRounds = 3;

/// Jacobian of a point's position by the newest node's pose, in the newest node's axes.
Eigen::Matrix<double, 2, 3> jacobian_of(const Eigen::Vector2d& ours_m) {
  Eigen::Matrix<double, 2, 3> jacobian;
  jacobian << Eigen::Matrix2d::Identity(), geometry::perpendicular(ours_m);
  return jacobian;
}

}  // namespace

geometry::SE2WithCovariance fit_place(std::span<const PairOfPasses> pairs,
                                      const geometry::SE2& map_T_newest,
                                      const geometry::SE2WithCovariance& expected) {
  const Eigen::Matrix3d prior = expected.covariance.inverse();
  geometry::SE2WithCovariance place{map_T_newest, {}};
  for (int round = 0; round < kFitRounds; ++round) {
    const Eigen::Matrix2d turned = place.mean.rotation().transpose();
    Eigen::Matrix3d information = prior;
    Eigen::Vector3d gradient = prior * (expected.mean.inverse() * place.mean).Log();
    for (const PairOfPasses& pair : pairs) {
      const Eigen::Matrix<double, 2, 3> jacobian = jacobian_of(pair.ours_m);
      const Eigen::Vector2d apart_m = turned * (place.mean * pair.ours_m - pair.theirs_m);
      information += jacobian.transpose() * jacobian / pair.variance_m2;
      gradient += jacobian.transpose() * apart_m / pair.variance_m2;
    }
    const auto factored = information.llt();
    place.mean = place.mean * geometry::SE2::Exp(-factored.solve(gradient));
    place.covariance = factored.solve(Eigen::Matrix3d::Identity());
  }
  return place;
}

std::vector<LeftOut> leave_out_each(std::span<const PairOfPasses> pairs,
                                    const geometry::SE2WithCovariance& map_T_newest) {
  std::vector<LeftOut> result;
  result.reserve(pairs.size());
  const Eigen::Matrix2d turned = map_T_newest.mean.rotation().transpose();
  for (const PairOfPasses& pair : pairs) {
    // The pose without the pair gives the residual (I - H)^-1 r, with the variance v (I - H)^-1.
    const Eigen::Matrix<double, 2, 3> jacobian = jacobian_of(pair.ours_m);
    const Eigen::Matrix2d of_place = jacobian * map_T_newest.covariance * jacobian.transpose();
    const Eigen::Matrix2d grows =
        (Eigen::Matrix2d::Identity() - of_place / pair.variance_m2).inverse();
    const Eigen::Vector2d apart_m = turned * (map_T_newest.mean * pair.ours_m - pair.theirs_m);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(grows, Eigen::EigenvaluesOnly);
    result.push_back({grows * apart_m, pair.variance_m2 * axes.eigenvalues().maxCoeff()});
  }
  return result;
}

double log_odds_of_place(std::span<const PairOfPasses> pairs, const geometry::SE2& map_T_newest,
                         const geometry::SE2WithCovariance& expected) {
  const Eigen::Vector3d off = (expected.mean.inverse() * map_T_newest).Log();
  const Eigen::Matrix3d prior = expected.covariance.inverse();
  const double log_per_pair = std::log(kSharedOfPasses / (1.0 - kSharedOfPasses));
  double log_odds = -0.5 * off.dot(prior * off);
  Eigen::Matrix3d information = prior;

  for (const PairOfPasses& pair : pairs) {
    const Eigen::Vector2d apart_m = map_T_newest * pair.ours_m - pair.theirs_m;
    log_odds += log_per_pair - 0.5 * apart_m.squaredNorm() / pair.variance_m2 -
                std::log(2.0 * std::numbers::pi * pair.variance_m2 * pair.clutter_per_m2);

    const Eigen::Matrix<double, 2, 3> jacobian = jacobian_of(pair.ours_m);
    information += jacobian.transpose() * jacobian / pair.variance_m2;
  }
  return log_odds + 0.5 * std::log(prior.determinant() / information.determinant());
}

double clutter_around(std::size_t number, std::span<const geometry::UncertainPoint> points,
                      double reach_m) {
  // Squared distances to the point itself and to the two nearest others.
  std::array<double, 3> nearest;
  nearest.fill(std::numeric_limits<double>::infinity());
  for (const geometry::UncertainPoint& other : points) {
    double squared = (other.position_m - points[number].position_m).squaredNorm();
    for (double& kept : nearest)
      if (squared < kept) std::swap(squared, kept);
  }
  const double all = static_cast<double>(points.size()) / (std::numbers::pi * reach_m * reach_m);
  return std::max({kLeastClutter, all, 1.0 / (std::numbers::pi * std::max(1e-6, nearest.back()))});
}

}  // namespace understory::geoslam_mapper::smoothing
