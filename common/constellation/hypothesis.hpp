// A hypothesis: a triangle of the observation similar to one of the map. Its motion and its test.
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
  /// Transforms the point to the other frame.
  Eigen::Vector2d operator*(const Eigen::Vector2d& p) const {
    return {c * p.x() - s * p.y() + t.x(), s * p.x() + c * p.y() + t.y()};
  }
};

/// A point that tests the hypotheses of one triangle, relative to that triangle's centroid.
struct TestPoint {
  Eigen::Vector2d about_centroid = Eigen::Vector2d::Zero();
  std::uint32_t point = 0;
  double gate_m = 0.0;
  /// Log likelihood ratio of a right against a wrong pose, if a landmark is in the gate ...
  double hit = 0.0;
  double miss = 0.0;  ///< ... and if none is.
};

/// One triangle of the observation, and the values that all its hypotheses share.
struct TriangleQuery {
  /// Points that are tested before the pose is refitted on all points.
  static constexpr std::size_t kTestPoints = 16;

  /// A query without test points.
  TriangleQuery(const Triangle& triangle, const PreparedObservation& observation);
  /// Adds the points nearest to the triangle as test points; there the error of the motion is
  /// smallest. O(points).
  void add_tests(const PreparedObservation& observation, const LocaliseParameters& parameters);
  /// map_T_centroid that moves the triangle to `landmark_m`.
  UnitMotion motion_to(const std::array<Eigen::Vector2d, 3>& landmark_m) const;

  Triangle triangle;
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  std::array<Eigen::Vector2d, 3> about_centroid;
  std::vector<TestPoint> tests;
};

}  // namespace understory::constellation
