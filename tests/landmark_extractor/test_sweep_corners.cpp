// Corners of houses in sweeps of lasers that scan in space.
#include <Eigen/LU>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "services/landmark_extractor/landmark_extractor.hpp"
#include "tests/catch.hpp"
#include "tests/landmark_extractor/simulated_space.hpp"

using namespace understory;
using namespace understory::landmark_extractor;
using namespace understory::test;

namespace {

/// A house whose corner nearest to the vehicle is at `corner`; the bisector points out of it.
test::Space house(const Eigen::Vector2d& corner, double bisector_rad, double top) {
  const auto wall_end = [&](double turned) {
    const double direction = bisector_rad + std::numbers::pi + turned;
    return Eigen::Vector2d(corner +
                           6.0 * Eigen::Vector2d(std::cos(direction), std::sin(direction)));
  };
  test::Space space;
  space.facades.push_back({wall_end(0.25 * std::numbers::pi), corner, top});
  space.facades.push_back({corner, wall_end(-0.25 * std::numbers::pi), top});
  return space;
}

/// Errors of corners in their covariances.
struct CornerNees {
  double plan = 0.0;
  double bisector = 0.0;
  int count = 0;

  CornerNees& operator+=(const CornerNees& other) {
    plan += other.plan;
    bisector += other.bisector;
    count += other.count;
    return *this;
  }
};

struct CornerNoise {
  int rings = 32;
  double range_sigma_m = 0.02;
  double tilt_sigma_rad = 0.003;
  double wave_m = 0.0;
};

/// Three houses around the vehicle, again and again.
CornerNees corner_nees(const CornerNoise& noise, int sweeps, std::mt19937_64& random) {
  std::uniform_real_distribution<double> ranges(5.0, 22.0);
  std::uniform_real_distribution<double> turns(-0.5, 0.5);
  std::uniform_real_distribution<double> lengths(1.0, 3.0);
  std::uniform_real_distribution<double> phases(0.0, 2.0 * std::numbers::pi);
  std::normal_distribution<double> tilts(0.0, noise.tilt_sigma_rad);
  LandmarkExtractorParameters parameters;
  parameters.sweep.range_sigma_m = noise.range_sigma_m;
  LandmarkExtractor extractor(parameters);
  test::Spinner spinner = test::spinner_of(noise.rings);
  spinner.sigma_m = noise.range_sigma_m;
  CornerNees result;
  for (int run = 0; run < sweeps; ++run) {
    test::Space space;
    std::vector<std::pair<Eigen::Vector2d, double>> truth;
    for (int k = 0; k < 3; ++k) {
      const double bearing = 2.0 * std::numbers::pi * k / 3.0 + turns(random);
      const Eigen::Vector2d corner =
          ranges(random) * Eigen::Vector2d(std::cos(bearing), std::sin(bearing));
      truth.emplace_back(corner, bearing + std::numbers::pi + turns(random));
      for (test::Facade wall : house(corner, truth.back().second, 6.0).facades) {
        wall.wave = noise.wave_m;
        wall.wave_length = lengths(random);
        wall.phase = phases(random);
        space.facades.push_back(wall);
      }
    }
    model::PointSweep turn = sweep(space, spinner, random);
    turn.attitude->level_Q_vehicle = Eigen::AngleAxisd(tilts(random), Eigen::Vector3d::UnitY()) *
                                     Eigen::AngleAxisd(tilts(random), Eigen::Vector3d::UnitX());
    turn.attitude->covariance_rad2 =
        noise.tilt_sigma_rad * noise.tilt_sigma_rad * Eigen::Matrix2d::Identity();
    for (const model::Detection& seen : extractor.extract(turn).detections) {
      for (const auto& [corner, bisector] : truth) {
        const Eigen::Vector2d error = seen.position_m.head<2>() - corner;
        if (seen.kind != model::LandmarkKind::kCorner || error.norm() > 0.5) continue;
        const Eigen::Matrix2d covariance = seen.covariance_m2.topLeftCorner<2, 2>();
        const double turned = std::remainder(seen.bearing_rad - bisector, 2.0 * std::numbers::pi) /
                              seen.bearing_sigma_rad;
        result += {error.dot(covariance.inverse() * error), turned * turned, 1};
      }
    }
  }
  return result;
}

}  // namespace

TEST_CASE("corners' covariances are true at all ranges, beams and noises", "[extractor]") {
  std::mt19937_64 random(21);
  CornerNees all;
  for (const int rings : {16, 32, 64}) {
    for (const double sigma : {0.01, 0.02, 0.03}) {
      for (const double tilt : {0.0, 0.003, 0.006}) {
        const CornerNees some = corner_nees(
            {.rings = rings, .range_sigma_m = sigma, .tilt_sigma_rad = tilt}, 6, random);
        INFO(rings << " beams, " << sigma << " m, " << tilt << " rad: " << some.plan / some.count
                   << ", " << some.bisector / some.count << " of " << some.count);
        CHECK(some.count >= 12);
        CHECK(some.plan < 4.0 * some.count);
        CHECK(some.bisector < 2.5 * some.count);
        all += some;
      }
    }
  }
  CHECK(all.plan / all.count > 1.5);
  CHECK(all.plan / all.count < 2.5);
  CHECK(all.bisector / all.count > 0.6);
  CHECK(all.bisector / all.count < 1.4);
}

TEST_CASE("what is uneven in a wall is in its corner's covariance", "[extractor]") {
  std::mt19937_64 random(22);
  for (const double wave : {0.01, 0.02}) {
    const CornerNees some =
        corner_nees({.rings = 64, .tilt_sigma_rad = 0.001, .wave_m = wave}, 15, random);
    INFO(some.plan / some.count << ", " << some.bisector / some.count << " of " << some.count);
    CHECK(some.count >= 30);
    CHECK(some.plan / some.count > 0.7);
    CHECK(some.plan / some.count < 3.0);
    CHECK(some.bisector / some.count < 1.2);
  }
}

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
      const model::LandmarkScan scan =
          extractor.extract(sweep(house(corner, bisector, 6.0), test::spinner_of(rings), random));
      for (const model::Detection& detection : scan.detections) {
        REQUIRE(detection.kind == model::LandmarkKind::kCorner);
        const Eigen::Vector2d error = detection.position_m.head<2>() - corner;
        REQUIRE(error.norm() < 0.009);
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
    CHECK(std::sqrt(square / found) < 0.004);
    CHECK(std::sqrt(square_rad2 / found) < 0.03 / 180.0 * std::numbers::pi);
    CHECK(nees / found < 3.5);
  }
}

TEST_CASE("an edge of a house is given once, whatever interrupts its walls", "[extractor]") {
  std::mt19937_64 random(5);
  LandmarkExtractor extractor;
  for (int run = 0; run < 10; ++run) {
    test::Space space;
    // Above and below windows the wall stands back a little; doors interrupt it.
    for (const test::Facade& wall : house({9.0, 3.0}, 3.4, 6.0).facades) {
      const Eigen::Vector2d along = wall.to - wall.from;
      space.facades.push_back({wall.from, wall.from + 0.35 * along, 6.0});
      space.facades.push_back({wall.from + 0.45 * along, wall.from + 0.6 * along, 6.0});
      space.facades.push_back({wall.from + 0.75 * along, wall.to, 6.0});
    }
    const model::LandmarkScan scan = extractor.extract(sweep(space, test::spinner_of(64), random));
    std::size_t at_edge = 0;
    for (const model::Detection& seen : scan.detections) {
      if ((seen.position_m.head<2>() - Eigen::Vector2d(9.0, 3.0)).norm() < 0.3) ++at_edge;
    }
    CHECK(at_edge == 1);
  }
}

TEST_CASE("an inner corner points to who sees it", "[extractor]") {
  std::mt19937_64 random(3);
  LandmarkExtractor extractor;
  test::Space room;
  room.facades = {{{8.0, -2.0}, {8.0, 5.0}, 5.0}, {{8.0, 5.0}, {1.0, 5.0}, 5.0}};
  const model::LandmarkScan scan = extractor.extract(sweep(room, test::spinner_of(64), random));
  REQUIRE(scan.detections.size() == 1);
  CHECK((scan.detections[0].position_m.head<2>() - Eigen::Vector2d(8.0, 5.0)).norm() < 1.2e-3);
  CHECK(scan.detections[0].bearing_rad == Approx(-0.75 * std::numbers::pi).margin(0.03));
}

TEST_CASE("cars, single walls and blunt angles are no corners", "[extractor]") {
  std::mt19937_64 random(4);
  LandmarkExtractor extractor;
  for (const int rings : {32, 64}) {
    const test::Space car = house({8.0, 3.0}, 3.5, 1.5);
    CHECK(extractor.extract(sweep(car, test::spinner_of(rings), random)).detections.empty());
    test::Space wall;
    wall.facades.push_back({{8.0, -6.0}, {8.0, 6.0}, 5.0});
    CHECK(extractor.extract(sweep(wall, test::spinner_of(rings), random)).detections.empty());
    test::Space blunt;
    blunt.facades = {{{8.0, -6.0}, {8.0, 0.0}, 5.0}, {{8.0, 0.0}, {11.0, 6.0}, 5.0}};
    CHECK(extractor.extract(sweep(blunt, test::spinner_of(rings), random)).detections.empty());
  }
  CHECK(extractor.sweep_counters().corners.low >= 1);
  CHECK(extractor.sweep_counters().corners.skew >= 1);
}
