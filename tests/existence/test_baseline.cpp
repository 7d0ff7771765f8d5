// The thesis's own rules.
#include "common/existence/baseline.hpp"

#include <limits>

#include "tests/catch.hpp"
#include "tests/existence/existence_scene.hpp"

using namespace understory;
using namespace understory::existence;
using test::look_from_face;

TEST_CASE("Baseline: seen once, never removed", "[existence]") {
  BaselinePoint point{BaselineParameters{}};
  point.miss(look_from_face(0).from_point_m);
  CHECK(point.probability() < 0.99);
  point.hit(look_from_face(3).from_point_m);
  CHECK(point.probability() == 1.0);
  for (int look = 0; look < 1000; ++look) point.miss(look_from_face(look % kFaces).from_point_m);
  CHECK(point.probability() == 1.0);
}

TEST_CASE("Baseline: a face below its threshold draws in", "[existence]") {
  BaselinePoint point{BaselineParameters{}};
  const Eigen::Vector3f near = look_from_face(0, 5.0).from_point_m;
  point.miss(near);
  CHECK(point.face_visibility(0) == Approx(0.95 * 0.1 / (1.0 - 0.95 * 0.9)));
  point.miss(near);
  // 0.655 * 0.1 / (1 - 0.59) = 0.16; the third miss passes 0.1 and takes the neighbours' mean.
  CHECK(point.face_visibility(0) == Approx(0.16).margin(0.01));
  point.miss(near);
  CHECK(point.face_visibility(0) == Approx(0.95));
  for (const auto vertex : kIcosahedron[0].vertices) CHECK(point.vertex_reach_m(vertex) == 20.0);
  // Beyond the reach it is not expected.
  const double before = point.probability();
  point.miss(look_from_face(0, 30.0).from_point_m);
  CHECK(point.probability() == before);
}

TEST_CASE("Baseline: a hit raises the nearest vertex", "[existence]") {
  BaselinePoint point{BaselineParameters{}};
  const Eigen::Vector3f at = (50.0 * icosahedron_vertex(2).normalized()).cast<float>();
  point.hit(at);
  CHECK(point.vertex_reach_m(2) == Approx(50.0));
  CHECK(point.vertex_reach_m(1) == 40.0);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  CHECK_THROWS_AS(point.hit({nan, 0.0F, 0.0F}), std::invalid_argument);
}
