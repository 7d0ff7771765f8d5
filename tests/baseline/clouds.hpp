// Random clouds of landmarks for the tests of the baseline method.
#pragma once

#include <Eigen/Core>
#include <random>
#include <vector>

#include "common/geometry/se2.hpp"

namespace understory::test {

/// `count` points, uniform in a square of side `side_m`.
inline std::vector<Eigen::Vector2d> random_cloud(std::size_t count, double side_m,
                                                 std::mt19937_64& random) {
  std::uniform_real_distribution<double> coordinate(0.0, side_m);
  std::vector<Eigen::Vector2d> cloud;
  while (cloud.size() < count) {
    const double x = coordinate(random);
    cloud.emplace_back(x, coordinate(random));
  }
  return cloud;
}

inline std::vector<Eigen::Vector2d> moved(const std::vector<Eigen::Vector2d>& cloud,
                                          const geometry::SE2& motion) {
  std::vector<Eigen::Vector2d> result;
  for (const Eigen::Vector2d& point : cloud) {
    result.push_back(motion * point);
  }
  return result;
}

}  // namespace understory::test
