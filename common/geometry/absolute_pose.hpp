// The pose of a calibrated camera from points of a map in its image; many pairs may be wrong.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace understory::geometry {

/// A point of a map and the direction in which the camera sees it.
struct PointSighting {
  Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();  ///< Unit, frame `camera`.
  Eigen::Vector3d point_m = Eigen::Vector3d::Zero();   ///< Frame `map`.
};

/// All poses camera_T_map from which three points are seen as stated: at most four, exact to
/// rounding; none where the points or the bearings are (nearly) in one line. Lambda Twist (Persson
/// & Nordberg, ECCV 2018).
std::vector<Eigen::Isometry3d> solve_three_points(const std::array<PointSighting, 3>& sightings);

/// Limits of the search.
struct AbsolutePoseParameters {
  double threshold_rad = 0.006;  ///< Largest angle between a bearing and the point as predicted.
  double sigma_rad = 0.0015;     ///< Standard deviation of a bearing, per axis.
  double confidence = 0.999;     ///< Probability that a sample without a wrong pair was drawn.
  int max_iterations = 2000;     ///< Samples of three pairs.
  std::size_t min_inliers = 12;  ///< With fewer inliers there is no pose.
};

/// Result of find_absolute_pose() and update_absolute_pose().
struct AbsolutePose {
  bool is_found = false;
  Eigen::Isometry3d camera_T_map = Eigen::Isometry3d::Identity();
  /// Order (rotation, translation) [rad, m], left perturbation: exp(rotation) and translation in
  /// `camera`, so the second block is also the covariance of the camera's position in the map, in
  /// the camera's axes. It follows from sigma_rad and the inliers.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::vector<std::uint32_t> inliers;  ///< Indices of pairs, ascending.
  double rms_rad = 0.0;                ///< RMS angle of the inliers, per axis.
  int iterations = 0;                  ///< Samples drawn, also where nothing was found.
};

/// The pose by RANSAC: samples of three pairs, the truncated sum of squares as score (MSAC, Torr &
/// Zisserman 2000), as many samples as the best share of inliers needs, then least squares over the
/// inliers. The same seed gives the same result. Cost O(iterations * pairs).
AbsolutePose find_absolute_pose(std::span<const PointSighting> pairs,
                                const AbsolutePoseParameters& parameters, std::uint64_t seed);

/// A pose with covariance before the image is used, for instance from odometry.
struct PosePrior {
  Eigen::Isometry3d camera_T_map = Eigen::Isometry3d::Identity();
  /// Order and frame as in AbsolutePose; positive definite.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Identity();
};
/// The most likely pose given the prior and pairs of which many may be wrong: it minimises the sum
/// of the pairs' truncated squares, each times its weight, and the prior's square. Weights are in
/// (0, 1], one for each pair: points that move together share one error, and together count once.
/// Guesses are the prior and the poses of `max_iterations` samples of three pairs, then
/// Gauss-Newton over all pairs that fit. The pose and its covariance hold also where no pair fits;
/// `is_found`: at least min_inliers pairs fit. The same seed gives the same result. Cost
/// O(iterations * pairs).
AbsolutePose update_absolute_pose(std::span<const PointSighting> pairs,
                                  std::span<const double> weights, const PosePrior& prior,
                                  const AbsolutePoseParameters& parameters, std::uint64_t seed);

/// Least squares over the given pairs, from `guess`. Without convergence it returns the best pose
/// so far.
Eigen::Isometry3d refine_absolute_pose(std::span<const PointSighting> pairs,
                                       std::span<const std::uint32_t> used,
                                       const Eigen::Isometry3d& guess);

}  // namespace understory::geometry
