// The place of a map from points that are known in both.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "common/reference_system/placing.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::reference_system;
using Catch::Matchers::Contains;

namespace {

struct Known {
  const char* system;
  Eigen::Vector2d origin;
};
const Known kPlaces[] = {{"EPSG:25832", {401234.5, 5654321.0}},
                         {"EPSG:32719", {345000.0, 6298000.0}},
                         {"EPSG:27572", {600000.0, 2428000.0}},
                         {"EPSG:2225", {6048000.0, 2200000.0}},
                         {"EPSG:4326", {7.589, 51.0456}}};

/// Points of a map that lies at `frame`, around a middle, with errors.
std::vector<CommonPoint> points_of(const std::string& system, const model::MapReference& frame,
                                   const Eigen::Vector2d& middle_m, double sigma_m,
                                   std::size_t count, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> side(-200.0, 200.0);
  const Transformation into = into_frame(system, frame);
  std::vector<CommonPoint> points;
  for (std::size_t i = 0; i < count; ++i) {
    CommonPoint one;
    const double x = side(random);
    one.map_m = middle_m + Eigen::Vector2d(x, side(random));
    const double dx = sigma_m * normal(random);
    one.world = into.inverse(one.map_m + Eigen::Vector2d(dx, sigma_m * normal(random)));
    one.sigma_m = std::max(sigma_m, 0.01);
    points.push_back(one);
  }
  return points;
}

double apart_m(const model::MapReference& a, const model::MapReference& b,
               const Eigen::Vector2d& at_m) {
  const Transformation between(a.definition, b.definition);
  return (between.forward(at_m) - at_m).norm();
}

}  // namespace

TEST_CASE("a map is found where it lies, whatever its frame and its distance from the points",
          "[reference_system]") {
  std::mt19937_64 random(61);
  std::uniform_real_distribution<double> angle(-3.1, 3.1);
  for (const Known& known : kPlaces) {
    CAPTURE(known.system);
    for (int i = 0; i < 10; ++i) {
      const auto frame = frame_at(known.system, known.origin, angle(random));
      const Eigen::Vector2d middle_m =
          i % 2 == 0 ? Eigen::Vector2d(30.0, -50.0) : Eigen::Vector2d(-6000.0, 3000.0);
      const auto points = points_of(known.system, frame, middle_m, 0.0, 2 + i, random);
      const Placing placing = place_map(known.system, points);
      CHECK(placing.rms_m < 1e-4);
      CHECK(std::abs(placing.scale - 1.0) < 1e-6);
      CHECK(placing.reference.system == frame.system);
      CHECK(apart_m(placing.reference, frame, middle_m) < 1e-4);
    }
  }
}

TEST_CASE("points on both sides of the date line place one map", "[reference_system]") {
  std::mt19937_64 random(65);
  const auto frame = frame_at("EPSG:4326", {179.9999, -16.8}, 0.7);
  const auto points = points_of("EPSG:4326", frame, {0.0, 0.0}, 0.0, 20, random);
  const auto longitude = [](const CommonPoint& one) { return one.world.x(); };
  REQUIRE(std::ranges::max(points, {}, longitude).world.x() > 179.0);
  REQUIRE(std::ranges::min(points, {}, longitude).world.x() < -179.0);
  const Placing placing = place_map("EPSG:4326", points);
  CHECK(placing.rms_m < 1e-4);
  CHECK(apart_m(placing.reference, frame, {0.0, 0.0}) < 1e-4);
}

TEST_CASE("residuals are what the points are off by, and wild ones pull little",
          "[reference_system]") {
  std::mt19937_64 random(62);
  for (int i = 0; i < 20; ++i) {
    const auto frame = frame_at("EPSG:25832", {401234.5, 5654321.0}, 0.1 * i);
    auto points = points_of("EPSG:25832", frame, {0.0, 0.0}, 0.05, 40, random);
    const Placing placing = place_map("EPSG:25832", points);
    // Two errors of 0.05 m each, and the fit takes 3 of 80 degrees of freedom.
    CHECK(placing.rms_m > 0.05);
    CHECK(placing.rms_m < 0.10);
    CHECK(apart_m(placing.reference, frame, {0.0, 0.0}) < 0.05);

    points[3].world += Eigen::Vector2d(30.0, -40.0);
    const Placing robust = place_map("EPSG:25832", points);
    CHECK(std::abs(robust.residuals_m[3] - 50.0) < 1.0);
    CHECK(apart_m(robust.reference, frame, {0.0, 0.0}) < 0.06);
  }
}

TEST_CASE("a wrong unit shows in the scale, swapped coordinates in the residuals",
          "[reference_system]") {
  std::mt19937_64 random(63);
  const auto frame = frame_at("EPSG:25832", {401234.5, 5654321.0}, 0.4);
  auto points = points_of("EPSG:25832", frame, {0.0, 0.0}, 0.0, 10, random);
  auto in_feet = points;
  for (CommonPoint& one : in_feet) one.map_m /= 0.3048;
  CHECK(place_map("EPSG:25832", in_feet).scale == Approx(0.3048).epsilon(1e-4));
  for (CommonPoint& one : points) one.map_m = {one.map_m.y(), one.map_m.x()};
  CHECK(place_map("EPSG:25832", points).rms_m > 20.0);
}

TEST_CASE("too few points, and points without a direction, are refused", "[reference_system]") {
  std::mt19937_64 random(64);
  const auto frame = frame_at("EPSG:25832", {401234.5, 5654321.0});
  auto points = points_of("EPSG:25832", frame, {0.0, 0.0}, 0.0, 1, random);
  CHECK_THROWS_WITH(place_map("EPSG:25832", points), Contains("two or more"));
  points.push_back(points.front());
  CHECK_THROWS_WITH(place_map("EPSG:25832", points), Contains("no direction"));
}
