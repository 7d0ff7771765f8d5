// How likely a place is, at which landmarks of two passes lie upon each other.
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
  double variance_m2 = 0.0;                            ///< Of their distance, per axis.
  double clutter_per_m2 = 0.0;                         ///< Density of the earlier pass's around.
};

/// Share of a pass's landmarks that another pass is taken to have seen, too: little, since what is
/// compared is whether passes lie upon each other here or nowhere.
inline constexpr double kSharedOfPasses = 0.3;

/// ln of the least odds of a place: 1e5.
inline constexpr double kLeastLogOdds = 11.5;
/// The same where the graph expects the place: 3000. That it is there is likely before anything is
/// seen, and where few landmarks are two are all that passes share.
inline constexpr double kLeastLogOddsWhereExpected = 8.0;
/// Largest squared Mahalanobis distance of such a place: 99 % of those that are as stated.
inline constexpr double kWhereExpected = 11.3;
/// Largest squared Mahalanobis distance of a place that was found to what the graph knows of it (3
/// degrees of freedom): noise that is stated too small by half has as much.
inline constexpr double kMostOff = 85.0;

/// Least squares over the pairs and what is expected, from `map_T_newest` on. O(pairs).
geometry::SE2WithCovariance fit_place(std::span<const PairOfPasses> pairs,
                                      const geometry::SE2& map_T_newest,
                                      const geometry::SE2WithCovariance& expected);

/// What the other pairs say of one.
struct LeftOut {
  Eigen::Vector2d apart_m = Eigen::Vector2d::Zero();  ///< How far off it is from where they put it.
  double variance_m2 = 0.0;  ///< Of that, larger axis: the pair's own and that of the place.
};
/// Of each pair, at a place that fit_place() gave. To first order. O(pairs).
std::vector<LeftOut> leave_out_each(std::span<const PairOfPasses> pairs,
                                    const geometry::SE2WithCovariance& map_T_newest);

/// ln of the odds that the newest node is where these pairs lie upon each other, against anywhere
/// else within what is expected, where the passes have nothing in common: Bayes' factor, with the
/// clutter as a Poisson process, integrated over the pose around `map_T_newest` (Laplace). Over all
/// clutter its mean is one, so that by Markov's inequality chance gives odds of k or more at most
/// once in k searches, for all places of a search together. `expected`: covariance of the newest
/// node's pose, right perturbation.
double log_odds_of_place(std::span<const PairOfPasses> pairs, const geometry::SE2& map_T_newest,
                         const geometry::SE2WithCovariance& expected);

/// Density around one of these points, of the others among them [1/m^2]: from the second nearest,
/// since trunks stand in clumps, and at least that of all within `reach_m` and 20 on a hectare.
/// O(n).
double clutter_around(std::size_t number, std::span<const geometry::UncertainPoint> points,
                      double reach_m);

}  // namespace understory::geoslam_mapper::smoothing
