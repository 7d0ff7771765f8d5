#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "services/landmark_extractor/landmark_extractor.hpp"
#include "tests/catch.hpp"
#include "tests/landmark_extractor/simulated_sweep.hpp"

using namespace understory;
using namespace understory::landmark_extractor;
using namespace understory::test;

namespace {

/// Parameters that describe the simulated laser: true circles, beams without width.
LandmarkExtractorParameters exact_world(double sigma) {
  LandmarkExtractorParameters parameters;
  parameters.planar.range_sigma_m = sigma;
  parameters.planar.beam_width_rad = 0.0;
  parameters.planar.roundness_sigma_m = 0.0;
  parameters.planar.shape_sigma_m = 0.0;
  return parameters;
}

}  // namespace

TEST_CASE("the centre of a lone trunk is found, with an honest covariance", "[extractor]") {
  constexpr double kSigma = 0.02;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> ranges(3.0, 20.0);
  std::uniform_real_distribution<double> bearings(-1.4, 1.4);
  std::normal_distribution<double> radii(0.15, 0.05);
  LandmarkExtractorParameters parameters = exact_world(kSigma);
  parameters.planar.prior_radius_sigma_m = 0.05;  // As drawn.
  LandmarkExtractor extractor(parameters);
  int found = 0;
  double error2 = 0.0;
  double nees = 0.0;
  constexpr int kRuns = 2000;
  for (int run = 0; run < kRuns; ++run) {
    const test::Circle trunk =
        test::circle_at(ranges(random), bearings(random), std::clamp(radii(random), 0.08, 0.4));
    const model::LandmarkScan scan = extractor.extract(sweep({trunk}, {}, kSigma, random));
    if (scan.detections.size() != 1) continue;
    ++found;
    const Eigen::Vector2d error = scan.detections[0].position_m.head<2>() - trunk.centre;
    const Eigen::Matrix2d covariance = scan.detections[0].covariance_m2.topLeftCorner<2, 2>();
    error2 += error.squaredNorm();
    nees += error.dot(covariance.inverse() * error);
  }
  CHECK(found >= 0.99 * kRuns);
  CHECK(std::sqrt(error2 / found) < 0.05);
  // 2 degrees of freedom; edges are uniform within a step, not Gaussian.
  CHECK(nees / found > 1.2);
  CHECK(nees / found < 2.6);
}

TEST_CASE("a trunk half hidden behind another keeps its centre", "[extractor]") {
  std::mt19937_64 random(2);
  LandmarkExtractor extractor(exact_world(0.01));
  // The near one covers the right half of the far one.
  const test::Circle near = test::circle_at(5.0, -0.02, 0.1);
  const test::Circle far = test::circle_at(12.0, 0.01, 0.35);
  const model::LandmarkScan scan = extractor.extract(sweep({near, far}, {}, 0.01, random));
  REQUIRE(scan.detections.size() == 2);
  for (const model::Detection& detection : scan.detections) {
    const test::Circle& truth = detection.position_m.x() < 8.0 ? near : far;
    const Eigen::Vector2d error = detection.position_m.head<2>() - truth.centre;
    const Eigen::Matrix2d covariance = detection.covariance_m2.topLeftCorner<2, 2>();
    CHECK(error.norm() < 0.035);
    CHECK(error.dot(covariance.inverse() * error) < 6.0);
  }
}

TEST_CASE("walls and fences are no trunks", "[extractor]") {
  std::mt19937_64 random(3);
  LandmarkExtractor extractor(exact_world(0.02));
  const std::vector<test::Wall> walls{{{10.0, -30.0}, {10.0, 30.0}},   // Across.
                                      {{2.0, 6.0}, {70.0, 9.0}},       // Seen at a grazing angle.
                                      {{20.0, -12.0}, {24.0, -12.0}},  // A short one.
                                      {{8.0, -3.0}, {8.0, -1.8}}};
  for (const test::Wall& wall : walls) {
    const model::LandmarkScan scan = extractor.extract(sweep({}, {wall}, 0.02, random));
    CHECK(scan.detections.empty());
  }
}

TEST_CASE("bushes are no trunks", "[extractor]") {
  std::mt19937_64 random(4);
  std::normal_distribution<double> spread(0.0, 0.8);
  LandmarkExtractor extractor(exact_world(0.02));
  std::size_t false_trunks = 0;
  for (int run = 0; run < 100; ++run) {
    std::vector<test::Circle> twigs;
    for (int i = 0; i < 60; ++i) {
      twigs.push_back({{12.0 + spread(random), 3.0 + spread(random)}, 0.02});
    }
    false_trunks += extractor.extract(sweep(twigs, {}, 0.02, random)).detections.size();
  }
  CHECK(false_trunks <= 2);
}

TEST_CASE("detections are moved into the frame of the vehicle", "[extractor]") {
  std::mt19937_64 random(5);
  LandmarkExtractorParameters parameters = exact_world(0.01);
  const test::Circle trunk = test::circle_at(8.0, 0.5, 0.15);
  model::PlanarScan scan = sweep({trunk}, {}, 0.01, random);
  const auto at_sensor = LandmarkExtractor(parameters).extract(scan);
  scan.vehicle_T_sensor = geometry::SE2(3.0, 0.5, 0.3);
  const auto moved = LandmarkExtractor(parameters).extract(scan);
  REQUIRE(at_sensor.detections.size() == 1);
  REQUIRE(moved.detections.size() == 1);
  const Eigen::Vector2d expected =
      scan.vehicle_T_sensor * Eigen::Vector2d(at_sensor.detections[0].position_m.head<2>());
  CHECK((moved.detections[0].position_m.head<2>() - expected).norm() < 1e-12);
  CHECK(moved.field_of_view.bearing_rad == Approx(0.3));
  CHECK(moved.detections[0].covariance_m2.trace() ==
        Approx(at_sensor.detections[0].covariance_m2.trace()));
}

TEST_CASE("malformed sweeps give nothing and are counted", "[extractor]") {
  LandmarkExtractor extractor;
  model::PlanarScan scan;
  scan.utime = 7;
  CHECK(extractor.extract(scan).detections.empty());
  scan.ranges_m.assign(361, std::numeric_limits<float>::quiet_NaN());
  scan.bearing_step_rad = 0.01;
  scan.max_range_m = 80.0;
  CHECK(extractor.extract(scan).utime == 7);
  scan.bearing_step_rad = std::numeric_limits<double>::quiet_NaN();
  CHECK(extractor.extract(scan).detections.empty());
  scan.bearing_step_rad = -1.0;
  CHECK(extractor.extract(scan).detections.empty());
  CHECK(extractor.counters().scans == 4);
  CHECK(extractor.counters().scans_malformed == 3);
}
