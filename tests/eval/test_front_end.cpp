// The measures of the associator and of the filter, on short drives.
#include "eval/experiments/frontend/ekf_consistency.hpp"
#include "eval/experiments/frontend/tracking.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval;

namespace {

sim::TrunkField small_forest() {
  sim::ForestParameters forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  forest.side_m = 250.0;
  return sim::make_trunk_field(forest, 3);
}

sim::InertialDriveParameters short_drive() {
  sim::InertialDriveParameters drive;
  drive.stationary_s = 1.0;
  drive.loop_length_m = 300.0;
  drive.range_m = 20.0;
  return drive;
}

}  // namespace

TEST_CASE("Tracking is scored against the truth", "[eval][front_end]") {
  const sim::TrunkField forest = small_forest();
  eval::experiments::frontend::TrackingOptions options;
  options.drive = short_drive();
  options.duration_s = 20.0;
  const eval::experiments::frontend::TrackingResult good = run_tracking(options, forest, 1);
  REQUIRE(good.purity > 0.999);
  REQUIRE(good.tracks > 20);
  REQUIRE(good.published_share > 0.8);
  REQUIRE(good.driven_km > 0.05);
  // The same score must tell a bad associator: nothing but the last motion, and no refinement.
  options.drive.odometry = sim::OdometryKind::kNone;
  options.associator.method = "nearest";
  const eval::experiments::frontend::TrackingResult bad = run_tracking(options, forest, 1);
  REQUIRE(bad.purity < good.purity);
  REQUIRE(bad.switches > good.switches);
}

TEST_CASE("Consistency is scored against the truth", "[eval][front_end]") {
  const sim::TrunkField forest = small_forest();
  eval::experiments::frontend::EkfDriveOptions options;
  options.drive = short_drive();
  options.duration_s = 12.0;

  std::vector<eval::experiments::frontend::EkfDriveResult> runs;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    runs.push_back(run_ekf_drive(options, forest, seed));
    REQUIRE(runs.back().nees.size() == 120);
  }

  const eval::experiments::frontend::EkfConsistency summary = summarise(runs);
  REQUIRE(summary.runs == 8);
  REQUIRE(summary.band_low < 3.0);
  REQUIRE(summary.band_high > 3.0);
  REQUIRE(summary.overall_nees > 0.5);
  REQUIRE(summary.overall_nees < 6.0);
  // Five degrees of freedom.
  REQUIRE(summary.overall_velocity_nees > 1.0);
  REQUIRE(summary.overall_velocity_nees < 10.0);
  REQUIRE(summary.drift_percent < 0.2);
  REQUIRE(summary.restarts == 0);

  // Errors that are ten times larger are out of the band.
  for (eval::experiments::frontend::EkfDriveResult& run : runs) {
    for (double& nees : run.nees) nees *= 100.0;
  }
  REQUIRE(share_in_band(runs, {1, 120}, runs.size()) < 0.02);
}

TEST_CASE("A simulator that errs by twice what it states is noticed", "[eval][front_end]") {
  const sim::TrunkField forest = small_forest();
  const auto mean_nees_of = [&](double factor) {
    eval::experiments::frontend::EkfDriveOptions options;
    options.drive = short_drive();
    options.drive.true_noise_factor = factor;
    options.duration_s = 12.0;
    std::vector<eval::experiments::frontend::EkfDriveResult> runs;
    for (std::uint64_t seed = 1; seed <= 4; ++seed)
      runs.push_back(run_ekf_drive(options, forest, seed));
    return mean_nees(runs, {1, 120});
  };
  const double exact = mean_nees_of(1.0);
  // The noise of detections is learned from the scans, that of IMU and level is not.
  CHECK(mean_nees_of(2.0) > 2.0 * exact);
  CHECK(mean_nees_of(0.5) < 0.9 * exact);

  // What is stated stays.
  sim::InertialDriveParameters drive = short_drive();
  sim::InertialDrive stated(drive, forest, 4);
  drive.true_noise_factor = 2.0;
  sim::InertialDrive doubled(drive, forest, 4);
  const auto& a = stated.next().scan.detections;
  const auto& b = doubled.next().scan.detections;
  REQUIRE(a.size() == b.size());
  CHECK(a.front().covariance_m2 == b.front().covariance_m2);
  CHECK(a.front().position_m != b.front().position_m);
}

TEST_CASE("A parked vehicle sways about its place, and its samples contain it",
          "[eval][front_end]") {
  const sim::TrunkField forest = small_forest();
  sim::InertialDriveParameters drive = short_drive();
  drive.stationary_s = 60.0;
  drive.sway_sigma_m = 2e-4;
  drive.sway_sigma_rad = 3e-5;
  drive.sway_sigma_mps = 0.01;
  drive.gyro_noise = drive.accelerometer_noise = 1e-9;
  drive.gyro_bias_sigma = drive.accelerometer_bias_sigma = 0.0;
  drive.gyro_walk = drive.accelerometer_walk = 0.0;

  sim::InertialDrive steps(drive, forest, 4);
  sim::DriveStep before = steps.next();
  std::vector<Eigen::Vector3d> places;
  double squared_mps = 0.0;

  for (int k = 1; k < 600; ++k) {
    const sim::DriveStep step = steps.next();
    REQUIRE(step.odometry.front().is_stationary);
    REQUIRE(step.driven_m == 0.0);
    const model::Preintegration& motion = *step.odometry.front().inertial;

    const Eigen::Matrix2d rotation = before.world_T_vehicle.rotation();
    const Eigen::Vector2d velocity = before.velocity_mps + rotation * motion.velocity_mps;
    const Eigen::Vector2d position = before.world_T_vehicle.translation() +
                                     before.velocity_mps * motion.seconds +
                                     rotation * motion.position_m;

    REQUIRE((velocity - step.velocity_mps).norm() < 1e-7);
    REQUIRE((position - step.world_T_vehicle.translation()).norm() < 1e-7);

    places.push_back(step.world_T_vehicle.coordinates());
    squared_mps += step.velocity_mps.squaredNorm() / (2.0 * 599.0);
    before = step;
  }

  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& place : places) mean += place / static_cast<double>(places.size());
  Eigen::Vector3d variance = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& place : places) {
    variance += (place - mean).cwiseAbs2() / static_cast<double>(places.size());
  }

  // A standard deviation of 600 draws is right within 15 %, a random walk would be 20 times larger.
  REQUIRE(std::abs(std::sqrt(variance.x()) / drive.sway_sigma_m - 1.0) < 0.07);
  REQUIRE(std::abs(std::sqrt(variance.y()) / drive.sway_sigma_m - 1.0) < 0.07);
  REQUIRE(std::abs(std::sqrt(variance.z()) / drive.sway_sigma_rad - 1.0) < 0.07);
  REQUIRE(std::abs(std::sqrt(squared_mps) / drive.sway_sigma_mps - 1.0) < 0.07);
}
