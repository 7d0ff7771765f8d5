// Models and looks for the tests.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <random>

#include "common/existence/icosahedral_shell.hpp"
#include "common/existence/point.hpp"

namespace understory::test {

using IcosahedralPoint = existence::PointExistence<existence::IcosahedralShell>;

/// The setting of the specification: nothing but faces, p_d and eps known.
inline existence::Parameters plain_parameters() {
  existence::Parameters parameters;
  parameters.pass_recall = 1.0;
  parameters.learn_recall = false;
  return parameters;
}

/// A look from the middle of a face.
inline existence::Look look_from_face(int face, double distance_m = 10.0) {
  const auto& vertices = existence::kIcosahedron[static_cast<std::size_t>(face)].vertices;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto vertex : vertices) middle += existence::icosahedron_vertex(vertex);
  return {(distance_m * middle.normalized()).cast<float>()};
}

/// A direction, uniform on the sphere.
inline Eigen::Vector3f random_direction(std::mt19937_64& random) {
  std::normal_distribution<float> normal;
  for (;;) {
    const float x = normal(random), y = normal(random);
    const Eigen::Vector3f direction(x, y, normal(random));
    if (direction.norm() > 1e-3F) return direction.normalized();
  }
}

}  // namespace understory::test
