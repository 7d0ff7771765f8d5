// A triangle of the observation that is like one of the map: the motion it means, and its test.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "common/constellation/observation.hpp"

namespace understory::constellation {

/// A rigid motion whose heading is kept as a unit vector: no trigonometry per hypothesis.
struct UnitMotion {
  double c = 1.0;
  double s = 0.0;
  Eigen::Vector2d t = Eigen::Vector2d::Zero();
  /// The point in the other frame.
  Eigen::Vector2d operator*(const Eigen::Vector2d& p) const {
    return {c * p.x() - s * p.y() + t.x(), s * p.x() + c * p.y() + t.y()};
  }
};

/// A point on which hypotheses of one triangle are tested, about that triangle's centroid.
struct TestPoint {
  Eigen::Vector2d about_centroid = Eigen::Vector2d::Zero();
  std::uint32_t point = 0;
  double gate_m = 0.0;
  /// Log likelihood ratio of right against wrong, if a landmark is in the gate ...
  double hit = 0.0;
  double miss = 0.0;  ///< ... and if not.
};

/// One triangle of the observation, with what all its hypotheses share.
struct TriangleQuery {
  /// Points looked at before a hypothesis is worth a refit on all.
  static constexpr std::size_t kTestPoints = 16;

  /// Without tests.
  TriangleQuery(const Triangle& triangle, const PreparedObservation& observation);
  /// The points nearest to the triangle; there its own error matters least. O(points).
  void add_tests(const PreparedObservation& observation, const LocaliseParameters& parameters);
  /// map_T_centroid that takes the triangle to `landmark_m`.
  UnitMotion motion_to(const std::array<Eigen::Vector2d, 3>& landmark_m) const;

  Triangle triangle;
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  std::array<Eigen::Vector2d, 3> about_centroid;
  std::vector<TestPoint> tests;
};

}  // namespace understory::constellation
