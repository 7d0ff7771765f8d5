// Iterative closest point (ICP) of two levelled clouds: point to point, point to plane,
// Generalised.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/place_recognition/verifier_parameters.hpp"
#include "common/place_recognition/verifiers/nearest_points.hpp"

namespace understory::place_recognition::verifiers {

/// The minimised function of a pair's difference d (Segal, Haehnel & Thrun 2009 §III: all three are
/// d^T M d).
enum class IcpMetric {
  kPointToPoint,  ///< M = I (thesis 002, algorithm 6).
  kPointToPlane,  ///< M = n n^T, n the normal of the frame's point.
  kGeneralised,   ///< M = (C_frame + R C_query R^T)^-1 (thesis 002 eq. 2.36).
};

/// A cloud prepared for ICP. A point's surface is estimated from its neighbours; with too few near
/// neighbours a point counts as round: normal and flattening are not used.
class IcpCloud {
 public:
  /// Uses finite points; of more than `most_points` every n-th is used. O(n log n).
  IcpCloud(std::span<const Eigen::Vector3f> points, const IcpParameters& parameters);

  /// The points and their neighbours.
  const NearestPoints& points() const { return points_; }
  /// Covariance of a point's position on its surface, dimensionless: 1 along it, plane_epsilon
  /// across it; identity for a round point.
  const Eigen::Matrix3d& covariance(std::size_t point) const { return covariance_[point]; }
  /// n n^T of a point; identity for a round point.
  const Eigen::Matrix3d& across(std::size_t point) const { return across_[point]; }
  /// Number of points.
  std::size_t size() const { return covariance_.size(); }

 private:
  NearestPoints points_;
  std::vector<Eigen::Matrix3d> covariance_;
  std::vector<Eigen::Matrix3d> across_;
};

/// A motion between two levelled frames: in the plane, and a difference of heights.
struct LevelMotion {
  geometry::SE2 plane;
  double up_m = 0.0;

  /// Transforms the point to the other frame.
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const;
};

/// Result of ICP.
struct IcpResult {
  LevelMotion frame_T_query;
  /// Covariance in the plane; tangent order, right perturbation.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::size_t inliers = 0;  ///< Query points with a partner within inlier_m.
  bool converged = false;
};

/// Alternates closest partners and the motion with the least sum of d^T M d; the largest distance
/// of partners (d_max) starts wide and is halved when the motion settles. The covariance is that of
/// the estimating equations at the end, H^-1 (sum over cubes of G G^T) H^-1, G the sum of the
/// gradients of the pairs in a cube of neighbour_radius_m: errors of points on one surface are
/// correlated, those on two surfaces are not. Partners change with the motion, so the true sum is
/// flatter than H where a point's partner is not the same point: covariances are multiplied by 6
/// for point to point, by 3 for point to plane (from Monte Carlo on clouds sampled twice; see the
/// tests), by 1 for Generalised ICP. Precondition: neither cloud is empty.
IcpResult icp(const IcpCloud& query, const IcpCloud& frame, IcpMetric metric,
              const geometry::SE2& start, const IcpParameters& parameters);

}  // namespace understory::place_recognition::verifiers
