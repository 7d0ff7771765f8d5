// The icosahedron's geometry, and the two shells as functions on the sphere.
#include "common/existence/icosahedron.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <set>

#include "common/existence/von_mises_fisher_shell.hpp"
#include "tests/catch.hpp"
#include "tests/existence/existence_scene.hpp"

using namespace understory;
using namespace understory::existence;

namespace {

/// The face whose normal is nearest, by trying all.
int slow_face(const Eigen::Vector3d& direction) {
  int best = 0;
  double most = -2.0;
  for (int face = 0; face < kFaces; ++face) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const auto vertex : kIcosahedron[static_cast<std::size_t>(face)].vertices)
      middle += icosahedron_vertex(vertex);
    if (middle.normalized().dot(direction) <= most) continue;
    most = middle.normalized().dot(direction);
    best = face;
  }
  return best;
}

}  // namespace

TEST_CASE("The golden rectangles' vertices form 20 regular faces", "[existence]") {
  std::set<std::set<int>> faces;
  for (const IcosahedronFace& face : kIcosahedron) {
    const Eigen::Vector3d a = icosahedron_vertex(face.vertices[0]);
    const Eigen::Vector3d b = icosahedron_vertex(face.vertices[1]);
    const Eigen::Vector3d c = icosahedron_vertex(face.vertices[2]);
    CHECK((a - b).norm() == Approx(2.0));
    CHECK((b - c).norm() == Approx(2.0));
    CHECK((c - a).norm() == Approx(2.0));
    CHECK(a.dot(b.cross(c)) > 0.0);
    faces.insert({face.vertices.begin(), face.vertices.end()});
  }
  CHECK(faces.size() == 20);
}

TEST_CASE("Neighbours of a face share two vertices with it", "[existence]") {
  for (int f = 0; f < kFaces; ++f) {
    const IcosahedronFace& face = kIcosahedron[static_cast<std::size_t>(f)];
    const std::set<int> vertices(face.vertices.begin(), face.vertices.end());
    std::set<int> neighbours;
    for (const auto neighbour : face.neighbours) {
      int shared = 0;
      for (const auto vertex : kIcosahedron[neighbour].vertices)
        shared += static_cast<int>(vertices.count(vertex));
      CHECK(shared == 2);
      neighbours.insert(neighbour);
    }
    CHECK(neighbours.size() == 3);
    CHECK(neighbours.count(f) == 0);
  }
}

TEST_CASE("A direction's face and weights are those found by trying all faces", "[existence]") {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 20000; ++trial) {
    const Eigen::Vector3f direction = test::random_direction(random);
    const FacePoint point = locate_on_icosahedron(direction);
    const Eigen::Vector3d exact = direction.cast<double>();
    REQUIRE(point.face == slow_face(exact));

    Eigen::Matrix3d corners;
    for (int i = 0; i < 3; ++i)
      corners.col(i) = icosahedron_vertex(point.vertices[static_cast<std::size_t>(i)]);
    Eigen::Vector3d weights = corners.inverse() * exact;
    weights /= weights.sum();
    for (int i = 0; i < 3; ++i)
      REQUIRE(point.weights[static_cast<std::size_t>(i)] == Approx(weights[i]).margin(1e-5));
  }
}

TEST_CASE("Axes, edges and vertices have a face that touches them", "[existence]") {
  for (int vertex = 0; vertex < kVertices; ++vertex) {
    const FacePoint point = locate_on_icosahedron(icosahedron_vertex(vertex).cast<float>());
    float at_vertex = 0.0F;
    for (std::size_t i = 0; i < 3; ++i)
      if (point.vertices[i] == vertex) at_vertex = point.weights[i];
    CHECK(at_vertex == Approx(1.0).margin(1e-5));
  }
  for (const float sign : {1.0F, -1.0F}) {
    for (int axis = 0; axis < 3; ++axis) {
      const FacePoint point = locate_on_icosahedron(sign * Eigen::Vector3f::Unit(axis));
      CHECK(point.weights[0] + point.weights[1] + point.weights[2] == Approx(1.0));
    }
  }
}

TEMPLATE_TEST_CASE("A shell's reach is raised to the distance, nowhere lowered", "[existence]",
                   IcosahedralShell, VonMisesFisherShell<6>) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<float> distance(1.0F, 80.0F);
  TestType shell(19.0F, 40.0F);
  for (int trial = 0; trial < 2000; ++trial) {
    auto place = shell.locate(test::random_direction(random));
    shell.multiply(place, 1.0F, 19.0F);
    const float before_m = shell.reach_m(place);
    const float distance_m = distance(random);
    shell.extend(place, distance_m);
    REQUIRE(shell.reach_m(place) == Approx(std::max(before_m, distance_m)).epsilon(1e-3));
  }
}

TEMPLATE_TEST_CASE("A shell's odds move by the ratio where one looked", "[existence]",
                   IcosahedralShell, VonMisesFisherShell<6>) {
  std::mt19937_64 random(3);
  TestType shell(1.0F, 40.0F);
  for (int trial = 0; trial < 200; ++trial) {
    // A vehicle's looks: level, from all around.
    const Eigen::Vector3f direction = test::random_direction(random);
    auto place = shell.locate(Eigen::Vector3f(direction.x(), direction.y(), 0.0F).normalized());
    shell.multiply(place, 1.0F, 1e30F);  // begins a lobe where there is none
    auto again = place;
    const float odds = shell.visibility_odds(again);
    shell.multiply(again, 1.2F, 1e30F);
    REQUIRE(shell.visibility_odds(again) == Approx(1.2F * odds).epsilon(0.06));
  }
}

TEST_CASE("Far from where one looked a von Mises-Fisher shell is as it was", "[existence]") {
  VonMisesFisherShell<6> shell(19.0F, 40.0F);
  for (int look = 0; look < 50; ++look) {
    auto place = shell.locate(Eigen::Vector3f::UnitX());
    shell.multiply(place, 0.1F, 19.0F);
  }
  CHECK(shell.visibility_odds(shell.locate(Eigen::Vector3f::UnitX())) < 1e-6F);
  CHECK(shell.visibility_odds(shell.locate(-Eigen::Vector3f::UnitX())) > 18.0F);
  CHECK(shell.visibility_odds(shell.locate(Eigen::Vector3f::UnitY())) > 9.0F);
  CHECK(shell.lobes() == 1);
}
