// Ways to decide which loop closures count, on the same drives.
#pragma once

#include <string>
#include <vector>

#include "eval/experiments/closures/closure_drive.hpp"

namespace understory::eval::experiments::closures {

/// What became of a closure.
enum class Fate : std::uint8_t { kAccepted, kWaiting, kRefused };

/// The end of a drive.
struct WayResult {
  std::vector<Fate> fates;           ///< As many as closures were sent.
  std::vector<geometry::SE2> poses;  ///< Of all nodes.
};

/// A way with its name in tables and documents.
struct Way {
  std::string name;
  WayResult (*decide)(const ClosureDrive& drive);
};

/// Squared Mahalanobis distance (3 degrees of freedom) within which a closure fits, for all ways:
/// that of geoslam_mapper::smoothing::Closures. Chance exceeds it once in 10^6.
inline constexpr double kFits = 30.7;

/// geoslam_mapper::smoothing::Closures on its own graph, closure by closure as they are sent.
WayResult shipped(const ClosureDrive& drive);
/// No closure counts.
WayResult odometry_alone(const ClosureDrive& drive);
/// All right closures and no wrong one count.
WayResult right_alone(const ClosureDrive& drive);
/// Pairwise consistency by odometry and the maximum clique (Mangelson et al., ICRA 2018, eq. 5 and
/// 8), all closures of the drive at once. Exact up to 2 million nodes of the search.
WayResult pairwise_consistency(const ClosureDrive& drive);
/// The same where variances of the odometry are always taken for 100 times those stated.
WayResult pairwise_consistency_wide(const ClosureDrive& drive);
/// Graduated non-convexity with truncated least squares (Yang et al., RA-L 2020, eq. 12 to 14).
WayResult graduated_non_convexity(const ClosureDrive& drive);
/// Dynamic covariance scaling (Agarwal et al., ICRA 2013, eq. 15) with Phi = 1, as published.
WayResult dynamic_covariance_scaling(const ClosureDrive& drive);
/// The same with Phi = 3000, the best of 30 to 10,000 where odometry is overconfident.
WayResult dynamic_covariance_scaling_wide(const ClosureDrive& drive);
/// Max-mixtures (Olson and Agarwal, IJRR 2013, eq. 5) of the closure and a null hypothesis with
/// 1e-9 of its information.
WayResult max_mixture(const ClosureDrive& drive);

/// ATE [m]: root mean square of the positions after one rigid alignment with the truth.
double ate_m(const std::vector<geometry::SE2>& poses, const std::vector<geometry::SE2>& truth);

}  // namespace understory::eval::experiments::closures
