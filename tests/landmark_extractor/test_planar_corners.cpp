// Corners of houses in scans of one plane.
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "services/landmark_extractor/landmark_extractor.hpp"
#include "tests/catch.hpp"
#include "tests/landmark_extractor/simulated_sweep.hpp"

using namespace understory;
using namespace understory::landmark_extractor;
using namespace understory::test;

namespace {

constexpr double kSigma_m = 0.02;

/// Flat walls.
LandmarkExtractorParameters flat_world() {
  LandmarkExtractorParameters parameters;
  parameters.planar.range_sigma_m = kSigma_m;
  parameters.planar_corner.flatness_sigma_m = 1e-4;
  return parameters;
}

/// Two walls that meet at `corner`; the bisector points out of the house.
std::vector<test::Wall> house(const Eigen::Vector2d& corner, double bisector_rad, double length_a_m,
                              double length_b_m, double angle_rad = 0.5 * std::numbers::pi) {
  const auto end = [&](double turned, double length_m) {
    const double direction = bisector_rad + std::numbers::pi + turned;
    return Eigen::Vector2d(corner +
                           length_m * Eigen::Vector2d(std::cos(direction), std::sin(direction)));
  };
  return {{corner, end(0.5 * angle_rad, length_a_m)}, {corner, end(-0.5 * angle_rad, length_b_m)}};
}

std::vector<model::Detection> corners_in(const model::LandmarkScan& scan) {
  std::vector<model::Detection> corners;
  for (const model::Detection& detection : scan.detections)
    if (detection.kind == model::LandmarkKind::kCorner) corners.push_back(detection);
  return corners;
}

/// The returns of a scan of a stationary vehicle, each with its time; counterclockwise or not.
model::PointSweep ring_of(const model::PlanarScan& scan, bool is_leftward) {
  model::PointSweep sweep;
  sweep.utime = scan.utime;
  sweep.rings = 1;
  sweep.max_range_m = scan.max_range_m;
  sweep.is_deskewed = true;
  const std::size_t count = scan.ranges_m.size();
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t beam = is_leftward ? k : count - 1 - k;
    if (!scan.is_return(beam)) continue;
    model::SweepPoint point;
    point.x_m = static_cast<float>(scan.ranges_m[beam] * std::cos(scan.bearing(beam)));
    point.y_m = static_cast<float>(scan.ranges_m[beam] * std::sin(scan.bearing(beam)));
    point.time_s = static_cast<float>(1.4e-4 * (static_cast<double>(k) - 360.0));
    sweep.points.push_back(point);
  }
  return sweep;
}

}  // namespace

TEST_CASE("corners in one plane are found, with honest covariances", "[extractor]") {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> ranges(4.0, 18.0);
  std::uniform_real_distribution<double> bearings(-1.0, 1.0);
  std::uniform_real_distribution<double> turns(-0.5, 0.5);
  LandmarkExtractor extractor(flat_world());
  constexpr int kRuns = 500;
  int found = 0;
  std::size_t all = 0;
  double error2 = 0.0;
  double nees = 0.0;
  double bisector = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    const double bearing = bearings(random);
    const Eigen::Vector2d at =
        ranges(random) * Eigen::Vector2d(std::cos(bearing), std::sin(bearing));
    const double out_rad = bearing + std::numbers::pi + turns(random);
    const auto scan = extractor.extract(sweep({}, house(at, out_rad, 6.0, 6.0), kSigma_m, random));
    const std::vector<model::Detection> corners = corners_in(scan);
    all += corners.size();
    if (corners.size() != 1) continue;
    const Eigen::Vector2d error = corners[0].position_m.head<2>() - at;
    if (error.norm() > 0.5) continue;
    ++found;
    error2 += error.squaredNorm();
    nees += error.dot(corners[0].covariance_m2.topLeftCorner<2, 2>().inverse() * error);
    const double turned = std::remainder(corners[0].bearing_rad - out_rad, 2.0 * std::numbers::pi) /
                          corners[0].bearing_sigma_rad;
    bisector += turned * turned;
  }
  CAPTURE(found, all, std::sqrt(error2 / found), nees / found, bisector / found);
  CHECK(found > 0.85 * kRuns);
  CHECK(all <= static_cast<std::size_t>(found) + 5);
  CHECK(std::sqrt(error2 / found) < 0.03);
  CHECK(nees / found > 1.4);
  CHECK(nees / found < 2.6);
  CHECK(bisector / found > 0.6);
  CHECK(bisector / found < 1.5);
}

TEST_CASE("lost beams do not take a corner away", "[extractor]") {
  std::mt19937_64 random(2);
  LandmarkExtractor extractor(flat_world());
  const auto walls = house({8.0, 1.0}, std::numbers::pi, 6.0, 6.0);
  for (int run = 0; run < 20; ++run) {
    model::PlanarScan scan = sweep({}, walls, kSigma_m, random);
    for (std::size_t beam = static_cast<std::size_t>(run); beam < scan.ranges_m.size(); beam += 17)
      scan.ranges_m[beam] = 0.0F;
    CHECK(corners_in(extractor.extract(scan)).size() == 1);
  }
}

TEST_CASE("cars, blunt angles and single walls have no corners in one plane", "[extractor]") {
  std::mt19937_64 random(3);
  LandmarkExtractor extractor(flat_world());
  const double out_rad = std::numbers::pi + 0.3;
  const std::vector<std::vector<test::Wall>> scenes{house({8.0, 1.0}, out_rad, 4.5, 1.8),
                                                    house({8.0, 1.0}, out_rad, 6.0, 6.0, 2.1),
                                                    house({8.0, 1.0}, out_rad, 6.0, 6.0, 1.1),
                                                    {{{8.0, -6.0}, {8.0, 6.0}}}};
  for (const std::vector<test::Wall>& walls : scenes)
    for (int run = 0; run < 20; ++run)
      CHECK(corners_in(extractor.extract(sweep({}, walls, kSigma_m, random))).empty());
}

TEST_CASE("a sweep of one ring has the landmarks of the scan that it was", "[extractor]") {
  std::mt19937_64 random(4);
  LandmarkExtractorParameters parameters = flat_world();
  parameters.planar.beam_width_rad = 0.0;
  LandmarkExtractor extractor(parameters);
  const std::vector<test::Circle> trunks{circle_at(6.0, -1.2, 0.2), circle_at(7.0, -0.8, 0.2),
                                         circle_at(12.0, -0.5, 0.15), circle_at(6.0, 1.3, 0.2)};
  const auto walls = house({8.0, 3.0}, std::numbers::pi + 0.2, 6.0, 6.0);
  const model::PlanarScan scan = sweep(trunks, walls, kSigma_m, random);
  const std::vector<model::Detection> at_once = extractor.extract(scan).detections;
  REQUIRE(at_once.size() == 5);
  for (const bool is_leftward : {true, false}) {
    const model::LandmarkScan ring = extractor.extract(ring_of(scan, is_leftward));
    // All but the first one: what was before its first return is not known.
    CAPTURE(is_leftward);
    REQUIRE(ring.detections.size() == 4);
    for (std::size_t i = 0; i < 4; ++i) {
      // Trunks from the right to the left, then the corner.
      const model::Detection& other = at_once[is_leftward ? i + 1 : (i < 3 ? i : 4)];
      CHECK(ring.detections[i].kind == other.kind);
      CHECK((ring.detections[i].position_m - other.position_m).head<2>().norm() < 0.01);
    }
    const double seen_rad = std::numbers::pi / 2.0 + 1.2;
    CHECK(ring.field_of_view.width_rad == Approx(seen_rad).margin(0.2));
  }
}
