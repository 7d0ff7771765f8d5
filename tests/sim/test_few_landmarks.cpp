// Forests thinned until scans show few trunks, and the drive with few landmarks and wheels.
#include "sim/few_landmarks.hpp"

#include <Eigen/LU>
#include <numbers>

#include "sim/drive.hpp"
#include "sim/point_grid.hpp"
#include "sim/random_streams.hpp"
#include "sim/stem_frames.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::sim;

namespace {

Forest a_forest() {
  ForestParameters parameters = forest_parameters(ForestKind::kIntermediate);
  parameters.side_m = 250.0;
  auto random = random_stream(14, Stream::kForest);
  return make_forest(parameters, random);
}

}  // namespace

TEST_CASE("A drive with few landmarks: two or three ahead in a scan, wheels as they state",
          "[few-landmarks]") {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    // A laser with one plane that looks ahead.
    DriveParameters parameters;
    parameters.path.interval = 1.0;
    parameters.sensor.range_m = 20.0;
    parameters.sensor.view_rad = std::numbers::pi;
    parameters.sensor.position_sigma_m = 0.03;
    parameters.trunks_in_view = 2.8;
    parameters.forest = forest_parameters(ForestKind::kIntermediate);
    parameters.forest.side_m = 400.0;
    parameters.path.length_m = 300.0;
    const Drive drive(parameters, seed);
    double detections = 0.0, nees = 0.0;
    std::size_t most = 0;
    for (std::size_t k = 0; k < drive.size(); ++k) {
      const model::LandmarkScan scan = drive.scan(k).scan;
      detections += static_cast<double>(scan.detections.size());
      most = std::max(most, scan.detections.size());
      for (const model::Detection& one : scan.detections) CHECK(one.position_m.x() > -1e-12);
      if (k == 0) continue;
      const model::Odometry odometry = drive.odometry(k);
      CHECK(odometry.from_T_to.Log() == drive.odometry(k).from_T_to.Log());
      const geometry::SE2 truth =
          drive.world_T_vehicle()[k - 1].inverse() * drive.world_T_vehicle()[k];
      const Eigen::Vector3d off = (truth.inverse() * odometry.from_T_to).Log();
      nees += off.dot(odometry.covariance.inverse() * off);
    }
    const auto scans = static_cast<double>(drive.size());
    CHECK(detections / scans > 2.0);
    CHECK(detections / scans < 3.0);
    CHECK(most < 9);
    CHECK(nees / (scans - 1.0) == Approx(3.0).margin(4.0 * std::sqrt(6.0 / scans)));
  }
}

TEST_CASE("A forest is thinned by spacing alone, and a drive of stem frames as much as wanted",
          "[few-landmarks]") {
  const Forest forest = a_forest();
  for (const double spacing_m : {5.0, 12.0, 30.0}) {
    const Forest few = thinned(forest, spacing_m, 3);
    const PointGrid grid(few.trunks_m, spacing_m);
    for (const Eigen::Vector2d& trunk : few.trunks_m)
      CHECK(grid.within(trunk, spacing_m).size() == 1);
    // None could be added.
    for (const Eigen::Vector2d& trunk : forest.trunks_m) CHECK(grid.any_within(trunk, spacing_m));
  }

  const Route way = make_stem_way(StemWay::kLaps, forest, 600.0, 6);
  StemDriveParameters parameters;
  parameters.detector.position_sigma_m = 0.0;
  parameters.detector.false_per_frame = 0.0;
  parameters.detector.seen_share = 1.0;
  parameters.detector.view_rad = std::numbers::pi;
  parameters.stems_in_view = 3.0;
  std::size_t stems = 0;
  const auto frames = drive_stem_frames(forest, way, parameters, 6);
  for (const model::StemFrame& frame : frames) {
    stems += frame.stems.size();
    for (const model::Stem& stem : frame.stems)
      CHECK((model::level_R_sensor(frame) * stem.position_m).x() > -1e-9);
  }
  const double per_frame = static_cast<double>(stems) / static_cast<double>(frames.size());
  CHECK(per_frame > 2.0);
  CHECK(per_frame < 3.3);
}
