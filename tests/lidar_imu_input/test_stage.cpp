#include <algorithm>
#include <cmath>
#include <random>

#include "services/lidar_imu_input/deskew.hpp"
#include "services/lidar_imu_input/lidar_imu_input.hpp"
#include "tests/catch.hpp"
#include "tests/lidar_imu_input/simulated_vehicle.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;
using namespace understory::test;

namespace {

template <class T>
std::vector<T> all_of(const InputResults& results) {
  std::vector<T> found;
  for (const InputResult& result : results)
    if (const auto* value = std::get_if<T>(&result)) found.push_back(*value);
  return found;
}

int faults_of(const InputResults& results, InputFaultKind kind) {
  int count = 0;
  for (const InputFault& fault : all_of<InputFault>(results)) count += fault.kind == kind;
  return count;
}

test::SensorErrors mild_errors() {
  test::SensorErrors errors;
  errors.gyro_bias = {0.003, -0.002, 0.004};
  errors.force_bias = {0.01, 0.01, 0.02};
  errors.gyro_noise = 3e-4;
  errors.force_noise = 4e-3;
  errors.wheel_noise_mps = 0.02;
  errors.wheel_scale = 1.01;
  return errors;
}

/// All messages of the sensors of a drive, in the order in which they come.
struct Run {
  test::Drive drive;
  double length_s = 40.0;
  bool has_wheels = true;
  test::SensorErrors errors = mild_errors();
  LidarImuInputParameters parameters = test::parameters_for_drive();
  std::vector<Eigen::Vector3d> world;
  model::Utime sweep_delay_us = 0;  ///< A sweep comes so long after its end.

  InputResults go(LidarImuInput& input) const {
    std::mt19937_64 random(1);
    const test::Track track(drive, length_s + 1.0);
    InputResults all;
    const auto take = [&all](InputResults results) {
      for (InputResult& result : results) all.push_back(std::move(result));
    };
    for (model::Utime t = 0; test::seconds(t) < length_s; t += 5'000) {
      take(input.add(imu_at(drive, t, 200.0, errors, random)));
      if (has_wheels && t % 20'000 == 0) take(input.add(wheels_at(drive, t, errors, random)));
      const model::Utime start = t - 103'000 - sweep_delay_us;
      if (start >= 0 && (start - 2'000) % 100'000 == 0 && !world.empty())
        take(input.add(sweep_at(track, start, parameters.lidar.mount.vehicle_T_sensor(), world)));
    }
    take(input.finish());
    return all;
  }
};

std::vector<Eigen::Vector3d> posts() {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> place(-60.0, 60.0);
  std::vector<Eigen::Vector3d> points(300);
  for (auto& p : points) p = {place(random), place(random), 0.1 * place(random)};
  return points;
}

}  // namespace

TEST_CASE("an increment of odometry ends at each sweep and comes before it", "[stage]") {
  Run run;
  run.world = posts();
  run.length_s = 30.0;
  run.has_wheels = GENERATE(true, false);
  run.sweep_delay_us = GENERATE(0, 40'000, 120'000);
  LidarImuInput input(run.parameters);
  const InputResults results = run.go(input);
  std::optional<model::Utime> end;
  int sweeps = 0;
  for (const InputResult& result : results) {
    if (const auto* odometry = std::get_if<model::Odometry>(&result)) {
      if (end) CHECK(odometry->from_utime == *end);
      CHECK(odometry->utime > odometry->from_utime);
      CHECK(odometry->utime - odometry->from_utime <= 160'000);
      CHECK(odometry->has_wheels == run.has_wheels);
      CHECK(odometry->inertial);
      end = odometry->utime;
    } else if (const auto* sweep = std::get_if<model::PointSweep>(&result)) {
      REQUIRE(end);
      CHECK(sweep->utime == *end);
      CHECK(sweep->is_deskewed);
      CHECK(sweep->attitude);
      ++sweeps;
    }
  }
  CHECK(sweeps >= 297);
  CHECK(input.counters().sweeps_dropped == 0);
  CHECK(input.counters().increments_missing == 0);
}

TEST_CASE("a sweep that comes very late is carried to the end of an increment", "[stage]") {
  Run run;
  run.world = posts();
  run.length_s = 5.0;
  run.sweep_delay_us = 270'000;
  LidarImuInput input(run.parameters);
  const auto sweeps = all_of<model::PointSweep>(run.go(input));
  CHECK(sweeps.size() > 40);
  CHECK(input.counters().sweeps_carried > 0);
  CHECK(std::ranges::is_sorted(sweeps, std::ranges::less_equal{}, &model::PointSweep::utime));
}

TEST_CASE("de-skewing puts points where they are at the end of the revolution", "[stage][deskew]") {
  Run run;
  run.world = posts();
  run.parameters.lidar.mount = {1.2, 0.1, 1.9, 0.02, -0.03, 0.4};
  run.has_wheels = GENERATE(true, false);
  LidarImuInput input(run.parameters);
  const test::Track track(run.drive, run.length_s + 1.0);
  double before = 0.0;
  double after = 0.0;
  double worst = 0.0;
  int count = 0;
  for (const model::PointSweep& sweep : all_of<model::PointSweep>(run.go(input))) {
    const double end = test::seconds(sweep.utime);
    if (end < run.drive.stand_s + 2.0) continue;
    const Eigen::Isometry3d vehicle_T_world = track.pose(end).inverse();
    REQUIRE(sweep.points.size() == run.world.size());
    const model::PointSweep raw = sweep_at(
        track, sweep.utime - 100'000, run.parameters.lidar.mount.vehicle_T_sensor(), run.world);
    for (std::size_t i = 0; i < run.world.size(); ++i) {
      const Eigen::Vector3d is = vehicle_T_world * run.world[i];
      const double error = (sweep.points[i].position().cast<double>() - is).norm();
      const Eigen::Vector3d skewed =
          run.parameters.lidar.mount.vehicle_T_sensor() * raw.points[i].position().cast<double>();
      before += (skewed - is).squaredNorm();
      after += error * error;
      worst = std::max(worst, error);
      ++count;
      CHECK(sweep.points[i].time_s <= 0.0F);
    }
  }
  before = std::sqrt(before / count);
  after = std::sqrt(after / count);
  CAPTURE(run.has_wheels, before, after, worst);
  CHECK(before > 0.3);
  CHECK(after < (run.has_wheels ? 0.01 : 0.05));
}

/// Points of the first sweep off where they are, RMS [m].
double first_sweep_error(model::Utime imu_period_us) {
  constexpr model::Utime kBegin = 40'000'000;
  test::Drive drive;
  drive.tilt_rad = 0.0;
  drive.rough_rad = 0.0;
  const test::Track track(drive, 42.0);
  auto world = posts();
  for (auto& point : world) point.z() = 0.0;  // tilt is not known yet
  LidarImuInputParameters parameters = test::parameters_for_drive();
  parameters.imu.max_gap_s = 0.3;
  LidarImuInput input(parameters);
  std::mt19937_64 random(1);
  InputResults all;
  const auto take = [&all](InputResults results) {
    for (InputResult& result : results) all.push_back(std::move(result));
  };
  for (model::Utime t = kBegin; t <= kBegin + 400'000; t += imu_period_us) {
    take(input.add(imu_at(drive, t, 10.0, {}, random)));
    take(input.add(wheels_at(drive, t, {}, random)));
    if (t == kBegin)
      take(input.add(
          sweep_at(track, kBegin - 70'000, parameters.lidar.mount.vehicle_T_sensor(), world)));
  }
  take(input.finish());
  const auto sweeps = all_of<model::PointSweep>(all);
  REQUIRE(sweeps.size() == 1);
  REQUIRE(sweeps.front().points.size() == world.size());
  const geometry::SE2 vehicle_T_world = track.planar(test::seconds(sweeps.front().utime)).inverse();
  double square_m2 = 0.0;
  for (std::size_t i = 0; i < world.size(); ++i) {
    const Eigen::Vector2d is = vehicle_T_world * Eigen::Vector2d(world[i].head<2>());
    square_m2 += (sweeps.front().points[i].position().head<2>().cast<double>() - is).squaredNorm();
  }
  return std::sqrt(square_m2 / static_cast<double>(world.size()));
}

TEST_CASE("a sweep that began before the first sample of a moving vehicle is de-skewed, too",
          "[stage][deskew]") {
  // The first state knows no velocity; at 7 m/s points of 0.07 s before it would be 0.3 m off.
  CHECK(first_sweep_error(GENERATE(10'000, 100'000)) < 0.08);
}

TEST_CASE("sweeps without times get them from the azimuth", "[stage][deskew]") {
  const bool clockwise = GENERATE(true, false);
  model::PointSweep sweep;
  for (int i = 0; i < 180; ++i) {
    const double angle = (clockwise ? -1.0 : 1.0) * 2.0 * (i + 0.5) * M_PI / 180.0 + 2.0;
    model::SweepPoint point;
    point.x_m = static_cast<float>(10.0 * std::cos(angle));
    point.y_m = static_cast<float>(10.0 * std::sin(angle));
    sweep.points.push_back(point);
  }
  sweep.has_times = false;
  times_from_azimuth(sweep, 0.1, clockwise);
  CHECK(sweep.has_times);
  for (std::size_t i = 0; i < 180; ++i)
    CHECK(sweep.points[i].time_s == Approx(0.1 * static_cast<double>(i) / 180.0).margin(1e-6));
}

TEST_CASE("odometry with wheels and gyro follows the drive", "[stage]") {
  Run run;
  run.length_s = 82.0;
  LidarImuInput input(run.parameters);
  const test::Track track(run.drive, run.length_s + 1.0);
  geometry::SE2WithCovariance driven;
  std::optional<model::Utime> from;
  model::Utime to = 0;
  for (const model::Odometry& increment : all_of<model::Odometry>(run.go(input))) {
    if (test::seconds(increment.from_utime) < run.drive.stand_s) continue;
    if (!from) from = increment.from_utime;
    driven = compound(driven, {increment.from_T_to, increment.covariance});
    to = increment.utime;
  }
  REQUIRE(from);
  const geometry::SE2 truth =
      track.planar(test::seconds(*from)).inverse() * track.planar(test::seconds(to));
  const Eigen::Vector3d error = (driven.mean.inverse() * truth).Log();
  const double nees = error.dot(driven.covariance.ldlt().solve(error));
  CAPTURE(error.transpose(), driven.covariance.diagonal().cwiseSqrt().transpose(), nees);
  CHECK(error.head<2>().norm() < 3.0);  // of about 360 m
  CHECK(std::abs(error.z()) < 0.02);
  CHECK(nees < 11.3);
}

TEST_CASE("wheels alone give what wheel odometry gives", "[stage]") {
  LidarImuInputParameters parameters;
  parameters.output.max_increment_s = 1.0;
  LidarImuInput input(parameters);
  WheelOdometry wheels(parameters.wheels);
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> steering(-0.4, 0.4);
  InputResults results;
  std::vector<model::Odometry> expected;
  model::Utime scan = 200'000;
  for (model::Utime t = 0; t < 20'000'000; t += 25'000) {
    while (scan < t) {
      model::PlanarScan turn;
      turn.utime = scan;
      for (InputResult& r : input.add(turn)) results.push_back(std::move(r));
      if (const auto increment = wheels.advance_to(scan)) expected.push_back(*increment);
      scan += 214'000;
    }
    const model::WheelSample sample{t, 0, 4.0, steering(random)};
    wheels.add(sample);
    for (InputResult& r : input.add(sample)) results.push_back(std::move(r));
  }
  for (InputResult& r : input.finish()) results.push_back(std::move(r));
  std::vector<model::Odometry> increments = all_of<model::Odometry>(results);
  // The stage starts at the first sample, not at the first scan.
  REQUIRE(!increments.empty());
  increments.erase(increments.begin());
  REQUIRE(increments.size() >= expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CHECK(increments[i].from_utime == expected[i].from_utime);
    CHECK(increments[i].from_T_to.coordinates() == expected[i].from_T_to.coordinates());
    CHECK(increments[i].covariance == expected[i].covariance);
    CHECK_FALSE(increments[i].inertial);
  }
  CHECK(all_of<model::PlanarScan>(results).size() == expected.size() + 1);
}

TEST_CASE("a velocity correction takes effect after its delay, and moves no position", "[stage]") {
  Run run;
  run.has_wheels = false;
  run.parameters.constraint.nonholonomic = false;
  const test::Track track(run.drive, 41.0);
  std::mt19937_64 random(1);
  LidarImuInput input(run.parameters);
  double worst_jump = 0.0;
  double worst_speed = 0.0;
  std::optional<model::RawPose> last;
  const auto watch = [&](const InputResults& results) {
    for (const model::RawPose& pose : all_of<model::RawPose>(results)) {
      if (last) {
        const double dt = test::seconds(pose.utime - last->utime);
        const double moved = (last->odom_T_vehicle.inverse() * pose.odom_T_vehicle).x();
        worst_jump = std::max(worst_jump, std::abs(moved));
        if (test::seconds(pose.utime) > 25.0)
          worst_speed = std::max(worst_speed,
                                 std::abs(moved / dt - run.drive.speed(test::seconds(pose.utime))));
      }
      last = pose;
    }
  };
  for (model::Utime t = 0; test::seconds(t) < 40.0; t += 5'000) {
    watch(input.add(imu_at(run.drive, t, 200.0, mild_errors(), random)));
    if (t >= 100'000 && t % 100'000 == 0) {
      model::VelocityCorrection correction;
      correction.utime = t - 100'000;
      const double then = test::seconds(correction.utime);
      correction.velocity_mps << run.drive.speed(then) * std::cos(run.drive.pitch(then)), 0.0;
      correction.bias << 0.004, 0.0, 0.0;
      correction.covariance.setIdentity();
      correction.covariance *= 1e-4;
      watch(input.add(correction));
    }
  }
  CAPTURE(worst_jump, worst_speed);
  CHECK(worst_jump < 8.5 * 0.02 + 0.01);
  CHECK(worst_speed < 0.3);
  CHECK(input.counters().corrections_late == 0);
  model::VelocityCorrection late;
  late.utime = 39'000'000;
  CHECK(faults_of(input.add(late), InputFaultKind::kLate) == 1);
  CHECK(input.counters().corrections_late == 1);
}

TEST_CASE("corrections that come late in one burst correct the velocity once", "[stage]") {
  Run run;
  run.has_wheels = false;
  run.parameters.constraint.nonholonomic = false;
  std::mt19937_64 random(1);
  LidarImuInput input(run.parameters);
  const auto correct = [&](model::Utime utime) {
    const double then = test::seconds(utime);
    model::VelocityCorrection correction;
    correction.utime = utime;
    correction.velocity_mps << run.drive.speed(then) * std::cos(run.drive.pitch(then)), 0.0;
    correction.bias << 0.004, 0.0, 0.0;
    correction.covariance.setIdentity();
    correction.covariance *= 1e-4;
    input.add(correction);
  };

  // From 20 s on none comes; those of 3.5 s come at once, then each in time again.
  constexpr model::Utime kFrom = 20'000'000, kTo = 23'500'000;
  double worst_mps = 0.0;
  std::optional<model::RawPose> last;
  for (model::Utime t = 0; t < 30'000'000; t += 5'000) {
    for (const model::RawPose& pose :
         all_of<model::RawPose>(input.add(imu_at(run.drive, t, 200.0, mild_errors(), random)))) {
      if (last && t > kTo + 200'000) {
        const double dt_s = test::seconds(pose.utime - last->utime);
        const double speed = (last->odom_T_vehicle.inverse() * pose.odom_T_vehicle).x() / dt_s;
        worst_mps =
            std::max(worst_mps, std::abs(speed - run.drive.speed(test::seconds(pose.utime))));
      }
      last = pose;
    }
    if (t < 200'000 || t % 100'000 != 0 || (t > kFrom && t < kTo)) continue;
    if (t == kTo)
      for (model::Utime held = kFrom; held < kTo - 100'000; held += 100'000) correct(held);
    correct(t - 100'000);
  }
  CAPTURE(worst_mps);
  CHECK(worst_mps < 0.1);
}

TEST_CASE("aided by GNSS the pose is a reference and drifts less", "[stage][gnss]") {
  Run run;
  run.has_wheels = false;
  run.length_s = 82.0;
  const test::Track track(run.drive, run.length_s + 1.0);
  double error[2] = {0.0, 0.0};
  for (const bool aided : {false, true}) {
    run.parameters.gnss_aided = aided;
    LidarImuInput input(run.parameters);
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    std::optional<model::RawPose> start;
    std::optional<model::RawPose> end;
    for (model::Utime t = 0; test::seconds(t) < run.length_s; t += 10'000) {
      InputResults results = input.add(imu_at(run.drive, t, 100.0, run.errors, random));
      if (t % 200'000 == 0) {
        model::GnssFix fix;
        fix.utime = t;
        const Eigen::Vector3d v = run.drive.velocity(test::seconds(t));
        // East and north lie turned against odom.
        fix.velocity_mps = Eigen::Rotation2Dd(1.1) * v.head<2>() +
                           0.05 * Eigen::Vector2d(normal(random), normal(random));
        fix.velocity_sigma_mps = 0.05;
        input.add(fix);
      }
      for (const model::RawPose& pose : all_of<model::RawPose>(results)) {
        CHECK(pose.is_reference == aided);
        if (!start && test::seconds(pose.utime) > 30.0) start = pose;
        end = pose;
      }
    }
    const geometry::SE2 truth = track.planar(test::seconds(start->utime)).inverse() *
                                track.planar(test::seconds(end->utime));
    error[aided] = ((start->odom_T_vehicle.inverse() * end->odom_T_vehicle).inverse() * truth)
                       .translation()
                       .norm();
  }
  CAPTURE(error[0], error[1]);
  CHECK(error[1] < 5.0);
  CHECK(error[1] < error[0]);
}
