// Odds of a pose at which landmarks of two passes coincide.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/geometry/registration.hpp"
#include "common/geometry/se2.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A landmark of this pass and one of an earlier pass that may be the same.
struct PairOfPasses {
  Eigen::Vector2d ours_m = Eigen::Vector2d::Zero();    ///< In the frame of the newest node.
  Eigen::Vector2d theirs_m = Eigen::Vector2d::Zero();  ///< In the map.
  double variance_m2 = 0.0;                            ///< Of their relative position, per axis.
  double clutter_per_m2 = 0.0;  ///< Density of the earlier pass's landmarks around.
};

/// Assumed share of a pass's landmarks that another pass observed, too: small, since the
/// alternative is that the passes coincide nowhere.
inline constexpr double kSharedOfPasses = 0.3;

/// ln of the least odds of a pose: 1e5.
inline constexpr double kLeastLogOdds = 11.5;
/// Likewise if the graph predicts the pose: 3000. Its prior probability is high, and with few
/// landmarks two common ones are often all.
inline constexpr double kLeastLogOddsWhereExpected = 8.0;
/// Largest squared Mahalanobis distance of such a pose: 99 % if the covariance is right.
inline constexpr double kWhereExpected = 11.3;
/// Largest squared Mahalanobis distance of a pose found from the graph's prediction (3 degrees of
/// freedom): allows for a stated sigma half as large as the true one.
inline constexpr double kMostOff = 85.0;

/// Least squares over the pairs and the expected pose, starting from `map_T_newest`. O(pairs).
geometry::SE2WithCovariance fit_place(std::span<const PairOfPasses> pairs,
                                      const geometry::SE2& map_T_newest,
                                      const geometry::SE2WithCovariance& expected);

/// Deviation of one pair from the pose by the other pairs.
struct LeftOut {
  Eigen::Vector2d apart_m =
      Eigen::Vector2d::Zero();  ///< Of the pair, from its position by the other pairs.
  double variance_m2 =
      0.0;  ///< Of that deviation, larger axis: the pair's own variance and that of the pose.
};
/// The deviation of each pair, at a pose from fit_place(). To first order. O(pairs).
std::vector<LeftOut> leave_out_each(std::span<const PairOfPasses> pairs,
                                    const geometry::SE2WithCovariance& map_T_newest);

/// ln of the odds that the newest node is at the pose where these pairs coincide, against any other
/// pose within the expectation, where the passes have nothing in common: Bayes factor, with the
/// clutter as a Poisson process, integrated over the pose around `map_T_newest` (Laplace). Its mean
/// over all clutter is one, so by Markov's inequality chance gives odds of k or more at most once
/// in k searches, for all poses of a search together. `expected`: covariance of the newest node's
/// pose, right perturbation.
double log_odds_of_place(std::span<const PairOfPasses> pairs, const geometry::SE2& map_T_newest,
                         const geometry::SE2WithCovariance& expected);

/// Density of the other points around one of these points [1/m^2]: from the second nearest, since
/// trunks stand in clumps, but at least the density of all within `reach_m` and at least 20 per
/// hectare. O(n).
double clutter_around(std::size_t number, std::span<const geometry::UncertainPoint> points,
                      double reach_m);

}  // namespace understory::geoslam_mapper::smoothing
