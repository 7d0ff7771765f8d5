// Errors of an estimated trajectory in the plane against the true one: ATE, RPE and NEES.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"

namespace understory::geometry {

/// An estimated pose and the true pose of the same instant, both in the same frame.
struct PosePair {
  SE2 estimate;
  SE2 truth;
  std::uint32_t map_id = 1;  ///< Estimates of different maps have no relative pose.
};

/// Absolute trajectory error (ATE) of positions [m].
struct AbsoluteError {
  double rms_m = 0.0;
  double largest_m = 0.0;
};
/// The error of the positions after the rigid motion of all estimates that makes the sum of squares
/// least (Umeyama 1991 without scale; `evo_ape tum TRUTH ESTIMATE --align`). None for fewer than
/// three poses. O(n).
std::optional<AbsoluteError> aligned_error(std::span<const PosePair> poses);

/// Relative pose error (RPE) over one length of the true path.
struct RelativeError {
  std::size_t pairs = 0;
  double translation_rms_m = 0.0;
  double translation_mean_percent = 0.0;  ///< Mean of error / true path of each pair.
  double rotation_rms_deg = 0.0;
  double rotation_mean_deg_per_m = 0.0;  ///< Mean of error / true path of each pair.
};
/// The share of a length by which the true path of a pair may differ from it.
inline constexpr double kPathTolerance = 0.1;
/// The error (truth_i^-1 truth_j)^-1 (estimate_i^-1 estimate_j) of each pair of poses i < j about
/// `length_m` (> 0) of true path apart. Pairs are those of `evo_rpe --delta LENGTH --delta_unit m
/// --all_pairs --pairs_from_reference`: each i, and of all later poses the j whose path from i is
/// nearest to `length_m`, if it differs by at most a tenth. The path is the sum of the distances
/// between successive poses. RMS values are those of evo_rpe; means for each metre of path are
/// those of the KITTI odometry benchmark, which takes every tenth pose as i, the first j beyond the
/// length, and divides by the length. A pair of poses in different maps is left out. None where the
/// drive has no pair. O(n log n).
std::optional<RelativeError> relative_error(std::span<const PosePair> poses, double length_m);

/// Accuracy of the truth itself: standard deviations of each true pose, 0 = exact.
struct TruthSigma {
  double position_m = 0.0;  ///< Per axis.
  double heading_rad = 0.0;
};
/// The covariance that errors of the truth add to the covariance of a pose's error (tangent of the
/// vehicle; x, y, theta [m, rad]): errors of the true pose here, and of the true pose that ties the
/// map, transformed to here. `tie_T_vehicle`: motion from the tie pose to this one; none where many
/// poses tie the map and their errors average out.
Eigen::Matrix3d covariance_of_truth(const TruthSigma& sigma,
                                    const std::optional<SE2>& tie_T_vehicle);

/// Normalised estimation error squared (NEES) of a pose: e^T covariance^-1 e with
/// e = Log(estimate^-1 * truth), three degrees of freedom. None where the covariance is not
/// positive definite or not finite (a zero covariance has no meaning).
std::optional<double> nees(const PosePair& pose, const Eigen::Matrix3d& covariance);

/// The band that holds 95 % of chi^2 of three degrees of freedom, 2.5 % below and 2.5 % above it.
inline constexpr double kNeesBandLow = 0.2157952826238981;
inline constexpr double kNeesBandHigh = 9.348403604496148;

/// Statistics of many values of NEES. Values of one drive are correlated: their mean scatters more
/// than the mean of as many independent values.
struct NeesSummary {
  std::size_t count = 0;
  double mean = 0.0;           ///< Expected: 3.
  double median = 0.0;         ///< Expected: 2.37.
  double share_in_band = 0.0;  ///< Expected: 0.95.
  double share_above = 0.0;    ///< Expected: 0.025; more means that sigmas are too small.
};
/// None where `nees` is empty. O(n).
std::optional<NeesSummary> summary_of(std::vector<double> nees);

}  // namespace understory::geometry
