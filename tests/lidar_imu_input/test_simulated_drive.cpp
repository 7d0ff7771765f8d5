// The input stage on the simulated forest drive: suspension, rough ground, real sensor errors.
#include <algorithm>
#include <cmath>

#include "services/lidar_imu_input/attitude_filter.hpp"
#include "services/lidar_imu_input/lidar_imu_input.hpp"
#include "sim/scenarios.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;

namespace {

constexpr double kDegree = M_PI / 180.0;

LidarImuInputParameters parameters_of(const sim::SensorSuite& suite) {
  LidarImuInputParameters parameters;
  const Eigen::Vector3d imu = suite.imu->vehicle_T_sensor.translation();
  const Eigen::Vector3d lidar = suite.lidar->vehicle_T_sensor.translation();
  parameters.imu.mount = {imu.x(), imu.y(), imu.z()};
  parameters.lidar.mount = {lidar.x(), lidar.y(), lidar.z()};
  parameters.wheels.car.wheelbase_m = 2.7;
  parameters.wheels.car.encoder_left_m = 0.0;
  return parameters;
}

struct Drive {
  explicit Drive(std::uint64_t seed, bool has_wheels, double length_m, bool has_lidar,
                 double wheel_scale_sigma = 5e-3) {
    sim::ForestScenarioParameters forest;
    forest.length_m = length_m;
    forest.margin_m = 60.0;
    sim::SensorSuite suite;
    suite.truth_rate_hz = 1.0;
    suite.lidar->columns = 360;
    suite.lidar->elevations_rad = sim::beam_elevations_rad(sim::LidarModel::kVlp16);
    suite.wheels->scale_sigma = wheel_scale_sigma;
    parameters = parameters_of(suite);
    if (!has_wheels) suite.wheels.reset();
    if (!has_lidar) suite.lidar.reset();
    drive = std::make_unique<sim::SensorDrive>(sim::forest_scenario(forest, seed),
                                               sim::SpeedParameters{}, suite, seed);
  }
  LidarImuInputParameters parameters;
  std::unique_ptr<sim::SensorDrive> drive;
};

struct Figures {
  double worst_tilt_rad = 0.0;
  double tilt_squares = 0.0;
  double tilt_nees = 0.0;
  int samples = 0;
  geometry::SE2WithCovariance driven;  ///< From the first increment that moves.
  std::optional<model::Utime> from;
  model::Utime to = 0;
  double inertial_nees = 0.0;  ///< 5 degrees of freedom, over an increment.
  int increments = 0;
  double before = 0.0;  ///< Of points, squared.
  double after = 0.0;
  int points = 0;
  int faults = 0;
};

void compare_tilt(const MotionEstimator& motion, const sim::VehicleState& truth, Figures& figures) {
  const RollPitchYaw is = roll_pitch_yaw(motion.attitude()->level_Q_vehicle());
  const Eigen::Vector2d error(is.roll_rad - truth.roll_rad, is.pitch_rad - truth.pitch_rad);
  figures.worst_tilt_rad = std::max(figures.worst_tilt_rad, error.cwiseAbs().maxCoeff());
  figures.tilt_squares += 0.5 * error.squaredNorm();
  figures.tilt_nees += error.dot(motion.attitude()->tilt_covariance().ldlt().solve(error));
  ++figures.samples;
}

/// Against the truth, with what is known of biases beforehand.
void compare_increment(const model::Odometry& increment, const sim::SensorDrive& drive,
                       Figures& figures) {
  const sim::VehicleState a = drive.state_at(increment.from_utime);
  const sim::VehicleState b = drive.state_at(increment.utime);
  if (!figures.from) figures.from = increment.from_utime;
  figures.driven = compound(figures.driven, {increment.from_T_to, increment.covariance});
  figures.to = increment.utime;
  const model::Preintegration& p = *increment.inertial;
  const Eigen::Matrix2d back = a.world_T_level().rotation().transpose();
  Eigen::Matrix<double, 5, 1> error;
  error << geometry::wrap_angle(p.yaw_rad - (b.yaw_rad - a.yaw_rad)),
      p.velocity_mps - back * (b.velocity_mps - a.velocity_mps).head<2>(),
      p.position_m - back * (b.position_m - a.position_m - a.velocity_mps * p.seconds).head<2>();
  const Eigen::Vector3d bias(1e-4, 0.05, 0.05);
  const Eigen::Matrix<double, 5, 5> covariance =
      p.covariance + p.bias_jacobian * bias.cwiseAbs2().asDiagonal() * p.bias_jacobian.transpose();
  figures.inertial_nees += error.dot(covariance.ldlt().solve(error));
  ++figures.increments;
}

void compare_sweep(const model::PointSweep& sweep, const model::PointSweep& raw,
                   sim::SensorDrive& drive, const SensorMount& mount, Figures& figures) {
  const Eigen::Isometry3d vehicle_T_world = drive.state_at(sweep.utime).world_T_vehicle().inverse();
  const auto truth = drive.sweep(sweep.revolution);
  if (sweep.points.size() != truth.true_m.size()) return;
  for (std::size_t i = 0; i < sweep.points.size(); i += 5) {
    const Eigen::Vector3d is = vehicle_T_world * truth.true_m[i].cast<double>();
    if (is.norm() > 40.0) continue;
    figures.after += (sweep.points[i].position().cast<double>() - is).squaredNorm();
    figures.before +=
        (mount.vehicle_T_sensor() * raw.points[i].position().cast<double>() - is).squaredNorm();
    ++figures.points;
  }
}

Figures run(Drive& scene) {
  LidarImuInput input(scene.parameters);
  Figures figures;
  std::optional<model::PointSweep> raw;
  const auto take = [&](const InputResults& results) {
    for (const InputResult& result : results) {
      figures.faults += std::holds_alternative<InputFault>(result);
      if (const auto* increment = std::get_if<model::Odometry>(&result)) {
        if (!increment->is_stationary) compare_increment(*increment, *scene.drive, figures);
      } else if (const auto* sweep = std::get_if<model::PointSweep>(&result)) {
        if (raw && sweep->utime > 30'000'000 && sweep->revolution % 10 == 0 &&
            raw->revolution == sweep->revolution)
          compare_sweep(*sweep, *raw, *scene.drive, scene.parameters.lidar.mount, figures);
      }
    }
  };
  while (const auto reading = scene.drive->next()) {
    if (const auto* imu = std::get_if<model::ImuSample>(&*reading)) {
      take(input.add(*imu));
      if (imu->utime > 22'000'000)
        compare_tilt(input.motion(), scene.drive->state_at(imu->utime), figures);
    } else if (const auto* wheels = std::get_if<model::WheelSample>(&*reading)) {
      take(input.add(*wheels));
    } else if (const auto* fix = std::get_if<model::GnssFix>(&*reading)) {
      take(input.add(*fix));
    } else if (const auto* sweep = std::get_if<sim::SimulatedSweep>(&*reading)) {
      raw = sweep->raw;
      take(input.add(sweep->raw));
    }
  }
  take(input.finish());
  return figures;
}

}  // namespace

TEST_CASE("a simulated drive with wheels: attitude, odometry and its consistency", "[sim]") {
  double nees = 0.0;
  constexpr int kRuns = 3;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    Drive scene(seed, true, 250.0, false);
    const Figures figures = run(scene);
    const double rms = std::sqrt(figures.tilt_squares / figures.samples);
    const geometry::SE2 truth = scene.drive->state_at(*figures.from).world_T_level().inverse() *
                                scene.drive->state_at(figures.to).world_T_level();
    const Eigen::Vector3d error = (figures.driven.mean.inverse() * truth).Log();
    const double drive_nees = error.dot(figures.driven.covariance.ldlt().solve(error));
    nees += drive_nees / kRuns;
    INFO("seed " << seed << ": tilt worst " << figures.worst_tilt_rad / kDegree << " rms "
                 << rms / kDegree << " deg, NEES " << figures.tilt_nees / figures.samples
                 << "; odometry error " << error.transpose() << " NEES " << drive_nees
                 << "; inertial NEES " << figures.inertial_nees / figures.increments);
    CHECK(figures.faults == 0);
    // What the accelerometer's bias (sigma 0.03 m/s^2) looks like at the start cannot be
    // distinguished from tilt.
    CHECK(figures.worst_tilt_rad < 0.35 * kDegree);
    CHECK(rms < 0.15 * kDegree);
    CHECK(figures.tilt_nees / figures.samples < 6.0);
    CHECK(error.head<2>().norm() < 0.01 * 250.0);
    CHECK(figures.inertial_nees / figures.increments < 7.5);
    CHECK(figures.inertial_nees / figures.increments > 0.5);
  }
  CHECK(nees < 7.8);
}

TEST_CASE("the wheels' scale is found without bias, whatever the ground and the start", "[sim]") {
  constexpr int kRuns = 8;
  double mean_error = 0.0;
  double nees = 0.0;
  for (std::uint64_t seed = 11; seed < 11 + kRuns; ++seed) {
    Drive scene(seed, true, 500.0, false, 0.0);
    LidarImuInput input(scene.parameters);
    while (const auto reading = scene.drive->next()) {
      if (const auto* imu = std::get_if<model::ImuSample>(&*reading)) input.add(*imu);
      if (const auto* wheels = std::get_if<model::WheelSample>(&*reading)) input.add(*wheels);
    }
    const AttitudeFilter& attitude = *input.motion().attitude();
    const double error = attitude.wheel_scale() - 1.0;
    mean_error += error / kRuns;
    nees += std::pow(error / attitude.wheel_scale_sigma(), 2) / kRuns;
  }
  INFO("mean error " << mean_error << ", NEES " << nees);
  CHECK(std::abs(mean_error) < 0.003);
  CHECK(nees < 2.0);
}

TEST_CASE("a simulated drive without wheels", "[sim]") {
  Drive scene(4, false, 250.0, false);
  const Figures figures = run(scene);
  INFO("tilt worst " << figures.worst_tilt_rad / kDegree << " deg, NEES "
                     << figures.tilt_nees / figures.samples << "; inertial NEES "
                     << figures.inertial_nees / figures.increments);
  CHECK(figures.worst_tilt_rad < 0.6 * kDegree);
  CHECK(figures.tilt_nees / figures.samples < 8.0);
  CHECK(figures.inertial_nees / figures.increments < 7.5);
}

TEST_CASE("simulated sweeps are de-skewed to a centimetre", "[sim][deskew]") {
  Drive scene(5, true, 60.0, true);
  const Figures figures = run(scene);
  REQUIRE(figures.points > 1000);
  const double before = std::sqrt(figures.before / figures.points);
  const double after = std::sqrt(figures.after / figures.points);
  INFO("point error " << before << " m before, " << after << " m after (range noise 0.02 m)");
  CHECK(before > 0.15);
  CHECK(after < 0.035);
}
