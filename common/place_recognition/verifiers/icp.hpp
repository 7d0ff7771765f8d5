// Iterative closest points of two levelled clouds: point to point, point to plane, Generalised.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/place_recognition/verifier_parameters.hpp"
#include "common/place_recognition/verifiers/nearest_points.hpp"

namespace understory::place_recognition::verifiers {

/// What is minimised of a pair's difference d (Segal, Haehnel & Thrun 2009 §III: all three are
/// d^T M d).
enum class IcpMetric {
  kPointToPoint,  ///< M = I (thesis 002, algorithm 6).
  kPointToPlane,  ///< M = n n^T, n the normal of the frame's point.
  kGeneralised,   ///< M = (C_frame + R C_query R^T)^-1 (thesis 002 eq. 2.36).
};

/// A cloud prepared for ICP. A point's surface follows from its neighbours; where it has too few of
/// them nearby it counts as round: normal and flattening are not used.
class IcpCloud {
 public:
  /// Of finite points; of more than `most_points` every n-th is taken. O(n log n).
  IcpCloud(std::span<const Eigen::Vector3f> points, const IcpParameters& parameters);

  /// The points and their neighbours.
  const NearestPoints& points() const { return points_; }
  /// Covariance of the place of a point on its surface, without a unit: 1 along it, plane_epsilon
  /// across it; the identity of a round one.
  const Eigen::Matrix3d& covariance(std::size_t point) const { return covariance_[point]; }
  /// n n^T of a point; the identity of a round one.
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

  /// The point in the other frame.
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const;
};

/// Where ICP ended.
struct IcpResult {
  LevelMotion frame_T_query;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Of the plane; tangent order, right.
  std::size_t inliers = 0;  ///< Query points with a partner within inlier_m.
  bool converged = false;
};

/// Closest partners and the motion of the least sum of d^T M d, in turn; the greatest distance of
/// partners (d_max) starts wide and is halved when the motion settles.
/// The covariance is that of the estimating equations at the end, H^-1 (sum over cubes of G G^T)
/// H^-1, G the sum of the gradients of the pairs in a cube of neighbour_radius_m: points of one
/// surface err together, those of two do not. Partners change with the motion, so the sum is
/// flatter than H says where a point's partner is not the point itself: covariances of point to
/// point are 6 times, of point to plane 3 times that (from Monte Carlo on clouds that were sampled
/// twice; the tests), of Generalised ICP once. Precondition: neither cloud is empty.
IcpResult icp(const IcpCloud& query, const IcpCloud& frame, IcpMetric metric,
              const geometry::SE2& start, const IcpParameters& parameters);

}  // namespace understory::place_recognition::verifiers
