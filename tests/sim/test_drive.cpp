#include <cmath>
#include <numbers>

#include "sim/drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::sim;
using namespace understory::sim;
using std::numbers::pi;

namespace {

std::vector<geometry::SE2> path_of(PathKind kind, double interval = 0.2, double length_m = 200.0) {
  PathParameters parameters;
  parameters.kind = kind;
  parameters.interval = interval;
  parameters.length_m = length_m;
  return make_path(parameters);
}

bool same_scan(const SimulatedScan& a, const SimulatedScan& b) {
  if (a.trunks != b.trunks || a.scan.utime != b.scan.utime) return false;
  for (std::size_t i = 0; i < a.trunks.size(); ++i) {
    if (a.scan.detections[i].position_m != b.scan.detections[i].position_m) return false;
  }
  return true;
}

DriveParameters drive_parameters(ForestKind forest, PathKind path) {
  DriveParameters parameters;
  parameters.forest = forest_parameters(forest);
  parameters.path.kind = path;
  return parameters;
}

}  // namespace

TEST_CASE("A path of 200 m has an observation every 0.2 m and every 0.2 rad", "[path]") {
  CHECK(path_of(PathKind::kCircle).size() == 1000);
  CHECK(path_of(PathKind::kLine).size() == 1000);
  CHECK(path_of(PathKind::kFigureEight).size() == 1000);
  CHECK(path_of(PathKind::kDoubleCircle).size() == 1000);
  CHECK(path_of(PathKind::kStationary).size() == 1000);
  CHECK(path_of(PathKind::kMeander, 0.2, 2000.0).size() == 10000);
  // 200 m and three rotations by pi/2, two of 2 pi/3: the steps that 1023.6 and 1020.9 begin.
  CHECK(path_of(PathKind::kSquare).size() == 1024);
  CHECK(path_of(PathKind::kTriangle).size() == 1021);
  CHECK(path_of(PathKind::kCircle, 0.1).size() == 2000);
}

TEST_CASE("Every step of a path costs one interval, shared between driving and rotating",
          "[path]") {
  const PathKind kind = GENERATE(PathKind::kCircle, PathKind::kLine, PathKind::kFigureEight,
                                 PathKind::kSquare, PathKind::kTriangle, PathKind::kMeander);
  const double length_m = kind == PathKind::kMeander ? 3000.0 : 200.0;
  const auto poses = path_of(kind, 0.2, length_m);
  const bool corners = kind == PathKind::kSquare || kind == PathKind::kTriangle;
  CHECK((poses.front().Log()).norm() == 0.0);
  for (std::size_t k = 1; k < poses.size(); ++k) {
    const Eigen::Vector3d xi = (poses[k - 1].inverse() * poses[k]).Log();
    const double effort = xi.head<2>().norm() + (corners ? std::abs(xi.z()) : 0.0);
    // A chord in which the vehicle also rotates is a little longer or shorter than its parts.
    REQUIRE(effort == Approx(0.2).margin(corners ? 2e-2 : 2e-3));
  }
}

TEST_CASE("Paths have the shapes of the figure", "[path]") {
  const auto circle = path_of(PathKind::kCircle);
  const double radius = 100.0 / pi;
  for (const geometry::SE2& pose : circle) {
    REQUIRE((pose.translation() - Eigen::Vector2d(0, radius)).norm() == Approx(radius));
  }

  const auto eight = path_of(PathKind::kFigureEight);
  CHECK((eight[500].translation()).norm() < 1e-6);
  CHECK(eight[250].y() > 0.0);  // left first
  CHECK(eight[750].y() < 0.0);
  const auto square = path_of(PathKind::kSquare);
  Eigen::Vector2d high = Eigen::Vector2d::Zero();
  for (const geometry::SE2& pose : square) high = high.cwiseMax(pose.translation());

  CHECK((high - Eigen::Vector2d(50, 50)).norm() < 1e-9);
  CHECK(square.back().theta() == Approx(-0.5 * pi));
  CHECK(path_of(PathKind::kTriangle).back().theta() == Approx(-2.0 * pi / 3.0));
}

TEST_CASE("A corner takes what is left of the step", "[path]") {
  // 30 m sides of a triangle at 0.4: 75 steps to the corner exactly; at 0.7 the 42nd step has 29.4
  // m behind it and 0.6 m before it, so the 43rd observation has turned by 0.1 rad.
  PathParameters parameters;
  parameters.kind = PathKind::kTriangle;
  parameters.length_m = 90.0;
  parameters.interval = 0.7;
  const auto poses = make_path(parameters);
  CHECK(poses[42].x() == Approx(29.4));
  CHECK(poses[43].x() == Approx(30.0));
  CHECK(poses[43].theta() == Approx(0.1));
}

TEST_CASE("The drive keeps clear of trunks and inside the forest", "[drive]") {
  const PathKind kind = GENERATE(PathKind::kCircle, PathKind::kLine, PathKind::kSquare);
  const ForestKind forest = GENERATE(ForestKind::kDense, ForestKind::kIntermediate);
  const Drive drive(drive_parameters(forest, kind), 11);
  for (const geometry::SE2& pose : drive.world_T_vehicle()) {
    REQUIRE(drive.grid().nearest(pose.translation())->distance_m > 0.3);
    REQUIRE(pose.translation().minCoeff() >= 40.0);
    REQUIRE(pose.translation().maxCoeff() <= 960.0);
  }
}

TEST_CASE("A long drive fells the trunks on its path", "[drive]") {
  DriveParameters parameters = drive_parameters(ForestKind::kSparse, PathKind::kMeander);
  parameters.path.length_m = 2000.0;
  parameters.path.lane_length_m = 300.0;
  parameters.clear_the_path = true;
  const Drive drive(parameters, 2);
  CHECK(drive.size() == 10000);
  for (const geometry::SE2& pose : drive.world_T_vehicle()) {
    REQUIRE(drive.grid().nearest(pose.translation())->distance_m > 0.3);
  }
  DriveParameters small = drive_parameters(ForestKind::kSparse, PathKind::kLine);
  small.forest.side_m = 150.0;
  CHECK_THROWS_AS(Drive(small, 2), std::runtime_error);
}

TEST_CASE("Detections have the noise, the rate and the range that were asked for", "[observe]") {
  const double sigma = GENERATE(0.05, 0.2, 0.4);
  const double rate = GENERATE(1.0, 0.9, 0.8);
  DriveParameters parameters = drive_parameters(ForestKind::kIntermediate, PathKind::kCircle);
  parameters.sensor.position_sigma_m = sigma;
  parameters.sensor.detection_probability = rate;
  const Drive drive(parameters, 4);
  double sum_squared = 0.0;

  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double count = 0.0;
  double in_range = 0.0;

  for (std::size_t k = 0; k < drive.size(); k += 4) {
    const SimulatedScan scan = drive.scan(k);
    REQUIRE(scan.trunks.size() == scan.scan.detections.size());
    const geometry::SE2 vehicle_T_world = scan.world_T_vehicle.inverse();

    // Well inside the range the test of the range does not cut the noise.
    for (std::size_t i = 0; i < scan.trunks.size(); ++i) {
      const Eigen::Vector2d seen = scan.scan.detections[i].position_m.head<2>();
      const Eigen::Vector2d truth = vehicle_T_world * drive.forest().trunks_m[scan.trunks[i]];
      REQUIRE(seen.norm() <= 40.0);
      REQUIRE(scan.scan.detections[i].covariance_m2(0, 0) == Approx(sigma * sigma));
      if (truth.norm() > 37.0) continue;
      sum += seen - truth;
      sum_squared += (seen - truth).squaredNorm();
      count += 1.0;
    }

    in_range +=
        static_cast<double>(drive.grid().within(scan.world_T_vehicle.translation(), 37.0).size());
  }

  const double error = 4.0 / std::sqrt(count);
  CHECK(std::sqrt(sum_squared / (2.0 * count)) == Approx(sigma).epsilon(error));
  CHECK((sum / count).norm() < error * sigma);
  CHECK(count / in_range == Approx(rate).epsilon(error));
}

TEST_CASE("A drive follows from its seed; scans do not depend on the order of asking", "[drive]") {
  const DriveParameters parameters = drive_parameters(ForestKind::kSparse, PathKind::kTriangle);
  const Drive a(parameters, 8);
  const Drive b(parameters, 8);
  const Drive c(parameters, 9);
  const SimulatedScan late = a.scan(700);
  CHECK(same_scan(a.scan(3), b.scan(3)));
  CHECK(same_scan(late, b.scan(700)));
  CHECK_FALSE(same_scan(late, c.scan(700)));
  CHECK(late.scan.sequence == 700);
  CHECK(late.scan.utime == 140000000);
}

TEST_CASE("A change of the sensor leaves forest and path as they were", "[drive]") {
  DriveParameters parameters = drive_parameters(ForestKind::kSparse, PathKind::kCircle);
  const Drive a(parameters, 8);
  parameters.sensor.position_sigma_m = 0.4;
  const Drive b(parameters, 8);
  CHECK(a.forest().trunks_m == b.forest().trunks_m);
  CHECK((a.world_T_vehicle()[0].inverse() * b.world_T_vehicle()[0]).Log().norm() == 0.0);
}
