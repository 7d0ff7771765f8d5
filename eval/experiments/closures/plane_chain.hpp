// A chain of poses with weighted closures, solved at once.
#pragma once

#include <vector>

#include "common/geometry/se2.hpp"

namespace understory::eval::experiments::closures {

/// A closure between two nodes of the chain; its information counts `weight` times.
struct WeightedClosure {
  std::size_t a = 0;
  std::size_t b = 0;
  geometry::SE2WithCovariance a_T_b;
  double weight = 1.0;
};

/// Poses tied by odometry, the first one held.
class PlaneChain {
 public:
  /// Starts from the odometry; `covariance` is that of each step.
  PlaneChain(std::vector<geometry::SE2> steps, const Eigen::Matrix3d& covariance);

  /// One Gauss-Newton step with these closures; returns the largest change of a pose [m or rad].
  /// Cost: one sparse factorisation.
  double step(const std::vector<WeightedClosure>& closures);
  /// Steps until nothing changes, at most `rounds`.
  void solve(const std::vector<WeightedClosure>& closures, int rounds = 20);

  /// Squared Mahalanobis distance of a closure at the estimate, as if its weight were 1.
  double chi2(const WeightedClosure& closure) const;
  const std::vector<geometry::SE2>& poses() const { return poses_; }
  /// Motion from node a to a later node b by the odometry alone, to first order. O(1).
  geometry::SE2WithCovariance odometry(std::size_t a, std::size_t b) const;

 private:
  std::vector<geometry::SE2> steps_;
  Eigen::Matrix3d information_;
  std::vector<geometry::SE2> reckoned_;
  std::vector<Eigen::Matrix3d> spread_;  ///< Of reckoned_, in the frame of the first pose.
  std::vector<geometry::SE2> poses_;
};

}  // namespace understory::eval::experiments::closures
