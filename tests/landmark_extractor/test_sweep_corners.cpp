// Corners of houses in sweeps of lasers that scan in space.
#include <Eigen/LU>
#include <numbers>
#include <random>

#include "services/landmark_extractor/landmark_extractor.hpp"
#include "tests/catch.hpp"
#include "tests/landmark_extractor/simulated_space.hpp"

using namespace understory;
using namespace understory::test;

namespace {

/// A house whose corner nearest to the vehicle is at `corner`; the bisector points out of it.
Space house(const Eigen::Vector2d& corner, double bisector_rad, double top) {
  const auto wall_end = [&](double turned) {
    const double direction = bisector_rad + std::numbers::pi + turned;
    return Eigen::Vector2d(corner +
                           6.0 * Eigen::Vector2d(std::cos(direction), std::sin(direction)));
  };
  Space space;
  space.facades.push_back({wall_end(0.25 * std::numbers::pi), corner, top});
  space.facades.push_back({corner, wall_end(-0.25 * std::numbers::pi), top});
  return space;
}

}  // namespace

TEST_CASE("a corner's place and bisector are found, with honest covariances", "[extractor]") {
  std::uniform_real_distribution<double> ranges(5.0, 18.0);
  std::uniform_real_distribution<double> bearings(-3.1, 3.1);
  std::uniform_real_distribution<double> turns(-0.5, 0.5);
  for (const int rings : {16, 64}) {
    std::mt19937_64 random(static_cast<std::uint64_t>(rings));
    LandmarkExtractor extractor;
    int found = 0;
    double square = 0.0;
    double square_rad2 = 0.0;
    double nees = 0.0;
    constexpr int kRuns = 25;
    for (int run = 0; run < kRuns; ++run) {
      const double bearing = bearings(random);
      const Eigen::Vector2d corner =
          ranges(random) * Eigen::Vector2d(std::cos(bearing), std::sin(bearing));
      const double bisector = bearing + std::numbers::pi + turns(random);
      const LandmarkScan scan =
          extractor.extract(sweep(house(corner, bisector, 6.0), spinner_of(rings), random));
      for (const Detection& detection : scan.detections) {
        REQUIRE(detection.kind == LandmarkKind::kCorner);
        const Eigen::Vector2d error = detection.position_m.head<2>() - corner;
        REQUIRE(error.norm() < 0.3);
        ++found;
        square += error.squaredNorm();
        const double turned =
            std::remainder(detection.bearing_rad - bisector, 2.0 * std::numbers::pi);
        square_rad2 += turned * turned;
        const Eigen::Matrix2d covariance = detection.covariance_m2.topLeftCorner<2, 2>();
        nees += error.dot(covariance.inverse() * error);
        CHECK(detection.position_m.z() == Approx(1.3).margin(0.4));
        CHECK(detection.bearing_sigma_rad > 0.0);
      }
    }
    CHECK(found >= 0.9 * kRuns);
    CHECK(found <= kRuns);
    CHECK(std::sqrt(square / found) < 0.05);
    CHECK(std::sqrt(square_rad2 / found) < 2.0 / 180.0 * std::numbers::pi);
    CHECK(nees / found < 3.0);  // Flat walls: better than walls are taken to be.
  }
}

TEST_CASE("an inner corner points to who sees it", "[extractor]") {
  std::mt19937_64 random(3);
  LandmarkExtractor extractor;
  Space room;
  room.facades = {{{8.0, -2.0}, {8.0, 5.0}, 5.0}, {{8.0, 5.0}, {1.0, 5.0}, 5.0}};
  const LandmarkScan scan = extractor.extract(sweep(room, spinner_of(64), random));
  REQUIRE(scan.detections.size() == 1);
  CHECK((scan.detections[0].position_m.head<2>() - Eigen::Vector2d(8.0, 5.0)).norm() < 0.05);
  CHECK(scan.detections[0].bearing_rad == Approx(-0.75 * std::numbers::pi).margin(0.03));
}

TEST_CASE("cars, single walls and blunt angles are no corners", "[extractor]") {
  std::mt19937_64 random(4);
  LandmarkExtractor extractor;
  for (const int rings : {32, 64}) {
    const Space car = house({8.0, 3.0}, 3.5, 1.5);
    CHECK(extractor.extract(sweep(car, spinner_of(rings), random)).detections.empty());
    Space wall;
    wall.facades.push_back({{8.0, -6.0}, {8.0, 6.0}, 5.0});
    CHECK(extractor.extract(sweep(wall, spinner_of(rings), random)).detections.empty());
    Space blunt;
    blunt.facades = {{{8.0, -6.0}, {8.0, 0.0}, 5.0}, {{8.0, 0.0}, {11.0, 6.0}, 5.0}};
    CHECK(extractor.extract(sweep(blunt, spinner_of(rings), random)).detections.empty());
  }
  CHECK(extractor.sweep_counters().corners.low >= 1);
  CHECK(extractor.sweep_counters().corners.skew >= 1);
}
