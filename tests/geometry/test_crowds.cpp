// Points that would make range queries and registration expensive: distant, vague, or very many.
#include <algorithm>
#include <random>

#include "common/geometry/gated_points.hpp"
#include "common/geometry/registration.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geometry;

namespace {

std::vector<Eigen::Vector2d> spread_points(std::size_t count, double half_side_m,
                                           std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(-half_side_m, half_side_m);
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < count; ++i) points.emplace_back(u(random), u(random));
  return points;
}

/// A scene, and the same as an observer at `pose` measures it, exactly.
struct Scene {
  SE2 pose{0.4, -0.3, 0.03};
  std::vector<UncertainPoint> reference;
  std::vector<UncertainPoint> observed;

  void add(const Eigen::Vector2d& point, double variance_m2 = 1e-4) {
    reference.push_back({point, variance_m2});
    observed.push_back({pose.inverse() * point, variance_m2});
  }
  Registration registered() const {
    const Eigen::Matrix3d covariance = Eigen::Vector3d(0.25, 0.25, 0.0025).asDiagonal();
    return register_points(reference, observed, {SE2(), covariance});
  }
  double error(const Registration& found) const {
    return (found.reference_T_observed.inverse() * pose).Log().norm();
  }
};

}  // namespace

TEST_CASE("Points in rows are found as brute force finds them, however far one is", "[rows]") {
  std::mt19937_64 random(1);
  for (const double distant_m : {0.0, 1e4, 1e7}) {
    auto points = spread_points(300, 20.0, random);
    points.emplace_back(-distant_m, distant_m);
    const PointRows rows(points, 2.0);
    for (const Eigen::Vector2d& centre : spread_points(60, 25.0, random)) {
      std::vector<std::uint32_t> found;
      rows.for_each_within(centre, 5.0, [&](std::uint32_t i, double d2) {
        REQUIRE(d2 == (points[i] - centre).squaredNorm());
        found.push_back(i);
      });
      std::ranges::sort(found);
      std::vector<std::uint32_t> expected;
      for (std::uint32_t i = 0; i < points.size(); ++i) {
        if ((points[i] - centre).norm() <= 5.0) expected.push_back(i);
      }
      REQUIRE(found == expected);

      // No more than those in the bins of the square are looked at.
      const auto near = std::ranges::count_if(points, [&](const Eigen::Vector2d& point) {
        return (point - centre).cwiseAbs().maxCoeff() <= 7.0;
      });
      CHECK(rows.count_around(centre, 5.0) <= static_cast<std::size_t>(near));
      CHECK(rows.count_around(centre, 5.0) >= found.size());
    }
    CHECK(rows.count_around({0.0, 0.0}, 1e9) == points.size());
  }
  CHECK(PointRows().count_around({0.0, 0.0}, 1e3) == 0);
}

TEST_CASE("A crowd is left out of a registration, and what stands alone is found",
          "[registration]") {
  std::mt19937_64 random(2);
  Scene scene;
  for (const Eigen::Vector2d& point : spread_points(60, 30.0, random)) scene.add(point);
  const std::size_t alone = scene.reference.size();
  for (int i = 0; i < 500; ++i) scene.add({60.0, 60.0 + 1e-3 * i});
  const Registration found = scene.registered();
  CHECK(scene.error(found) < 1e-3);
  CHECK(found.pairs.size() >= alone - 4);
  CHECK(found.pairs.size() <= alone);
  for (const PointPair& pair : found.pairs) CHECK(pair.reference == pair.observed);
}

TEST_CASE("One distant point disturbs no registration", "[registration]") {
  std::mt19937_64 random(3);
  Scene scene;
  for (const Eigen::Vector2d& point : spread_points(400, 60.0, random)) scene.add(point);
  const Registration before = scene.registered();
  scene.add({1e7, -1e7});
  const Registration after = scene.registered();
  CHECK(scene.error(after) < 1e-3);
  CHECK(after.pairs.size() >= before.pairs.size());
}

TEST_CASE("A vague point widens no gate of the others, and a crowd is not looked at", "[rows]") {
  std::mt19937_64 random(5);
  const auto points = spread_points(400, 60.0, random);
  GatedPoints gated(2.0, 1.0);
  for (const Eigen::Vector2d& point : points) gated.add(point, 1e-4);
  gated.add({0.0, 0.0}, 1e8);
  for (int i = 0; i < 200; ++i) gated.add({500.0, 1e-3 * i}, 1e-4);
  gated.sort();

  for (const Eigen::Vector2d& point : points) {
    std::vector<std::uint32_t> found;
    gated.for_each_near(point, 4.0, 1e-2, [&](std::uint32_t i, double) { found.push_back(i); });
    CHECK(std::ranges::count(found, 400U) == 1);
    for (const std::uint32_t i : found) {
      if (i < 400) CHECK((points[i] - point).norm() < 0.5);
    }
  }
  std::size_t in_crowd = 0;
  gated.for_each_near({500.0, 0.1}, 4.0, 1e-2, [&](std::uint32_t, double) { ++in_crowd; });
  CHECK(in_crowd == 1);  // The vague one.
}

TEST_CASE("A rotation is found with the nearest of many points, and all are paired",
          "[registration]") {
  std::mt19937_64 random(4);
  Scene scene;
  scene.pose = SE2(0.0, 0.0, 0.3);
  for (const Eigen::Vector2d& point : spread_points(900, 80.0, random)) scene.add(point);
  int asked = 0;
  const Registration found =
      register_step(scene.reference, scene.observed, SE2(), SE2(), StepModel{}, {},
                    [&](const Registration&) { return ++asked > 1; });
  CHECK(scene.error(found) < 1e-3);
  CHECK(found.pairs.size() > 850);
}

TEST_CASE("A point whose variance is the limit is not vague", "[rows]") {
  // 200 points in a row, of which a narrow gate meets few; a vague one reaches all of them.
  GatedPoints gated(2.0, 1.0);
  for (int i = 0; i < 200; ++i) gated.add({static_cast<double>(i), 0.0}, 1.0);
  gated.add({0.0, 0.0}, 1e6);
  gated.sort();
  for (int i = 0; i < 200; ++i) {
    bool is_found = false;
    std::size_t found = 0;
    gated.for_each_near({static_cast<double>(i), 0.0}, 4.0, 1e-2, [&](std::uint32_t k, double) {
      is_found = is_found || k == static_cast<std::uint32_t>(i);
      ++found;
    });
    CHECK(is_found);
    CHECK(found <= 10);
  }
}
