#include <cmath>
#include <numbers>
#include <random>

#include "sim/motion_sensors.hpp"
#include "sim/path.hpp"
#include "sim/route.hpp"
#include "sim/vehicle_motion.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::sim;
using namespace understory::sim;

namespace {

Route route_of(PathKind kind, double length_m) {
  PathParameters parameters;
  parameters.kind = kind;
  parameters.length_m = length_m;
  parameters.interval = 0.5;
  std::vector<Eigen::Vector2d> points;
  for (const geometry::SE2& pose : make_path(parameters)) points.push_back(pose.translation());
  return Route::through(points, 6.0);
}

Ground rough_ground() {
  std::mt19937_64 random(5);
  return {GroundParameters{.slope = {0.04, 0.02}, .relief_m = 0.5, .roughness_m = 0.03}, random};
}

VehicleMotion motion_on(PathKind kind, double length_m) {
  return {route_of(kind, length_m), rough_ground(), VehicleParameters{}, SpeedParameters{}};
}

}  // namespace

TEST_CASE("A route keeps near its waypoints and has continuous curvature", "[route]") {
  const PathKind kind = GENERATE(PathKind::kCircle, PathKind::kSquare, PathKind::kFigureEight);
  const Route route = route_of(kind, 400.0);
  CHECK(route.length_m() == Approx(400.0).epsilon(0.05));
  double greatest_change = 0.0;

  for (double s = 0.0; s + 0.25 < route.length_m(); s += 0.25) {
    const auto here = route.at(s);
    const auto next = route.at(s + 0.25);
    CHECK((next.position_m - here.position_m).norm() == Approx(0.25).epsilon(0.02));
    greatest_change = std::max(greatest_change, std::abs(next.curvature - here.curvature));
    // The heading is that of the step, on average.
    const double bearing = std::atan2((next.position_m - here.position_m).y(),
                                      (next.position_m - here.position_m).x());
    const double middle =
        here.heading_rad + 0.5 * geometry::wrap_angle(next.heading_rad - here.heading_rad);
    CHECK(std::abs(geometry::wrap_angle(bearing - middle)) < 0.002);
  }

  CHECK(greatest_change < 0.05);
  CHECK((route.at(0.0).position_m - Eigen::Vector2d::Zero()).norm() < 0.1);
}

TEST_CASE("Rates and accelerations are the derivatives of the pose", "[motion]") {
  const VehicleMotion motion = motion_on(PathKind::kFigureEight, 300.0);
  const double h = 1e-4;
  for (double t = 20.0; t + 1.0 < motion.duration_s(); t += 0.37) {
    const VehicleState before = motion.at(t - h);
    const VehicleState here = motion.at(t);
    const VehicleState after = motion.at(t + h);
    CHECK(((after.position_m - before.position_m) / (2 * h) - here.velocity_mps).norm() < 1e-7);
    CHECK(((after.velocity_mps - before.velocity_mps) / (2 * h) - here.acceleration_mps2).norm() <
          1e-6);
    const Eigen::AngleAxisd turn(before.world_Q_vehicle.conjugate() * after.world_Q_vehicle);
    CHECK((turn.angle() * turn.axis() / (2 * h) - here.angular_rate_rad_s).norm() < 1e-7);
    CHECK(((after.angular_rate_rad_s - before.angular_rate_rad_s) / (2 * h) -
           here.angular_acceleration_rad_s2)
              .norm() < 1e-6);
  }
}

TEST_CASE("The car is stationary first, keeps its limits, and stays on the ground", "[motion]") {
  const Ground ground = rough_ground();
  SpeedParameters speed;
  speed.stops = {{100.0, 6.0}};
  const VehicleMotion motion(route_of(PathKind::kSquare, 400.0), ground, {}, speed);
  double fastest = 0.0;
  double stationary_s = 0.0;

  for (double t = 0.0; t < motion.duration_s(); t += 0.05) {
    const VehicleState state = motion.at(t);
    const Eigen::Vector3d velocity = state.world_Q_vehicle.conjugate() * state.velocity_mps;
    const Eigen::Vector3d force = state.world_Q_vehicle.conjugate() * state.acceleration_mps2;
    fastest = std::max(fastest, velocity.x());

    if (t < 20.0) {
      CHECK(state.velocity_mps.norm() < 1e-12);
      CHECK(state.angular_rate_rad_s.norm() < 1e-12);
    }

    if (t > 25.0 && state.velocity_mps.norm() < 1e-6) stationary_s += 0.05;
    CHECK(velocity.x() > -1e-6);
    CHECK(std::abs(velocity.y()) < 0.05);  // the rear axle does not slip, but it sways
    CHECK(std::abs(force.y()) < 1.5 * 1.1 + 0.5);
    CHECK(std::abs(force.x()) < 1.5 * 1.1 + 0.5);
    CHECK(std::abs(state.position_m.z() - ground.height(state.position_m.head<2>())) < 0.2);
    CHECK(std::abs(state.roll_rad) < 0.3);

    CHECK(std::abs(state.pitch_rad) < 0.3);
  }

  CHECK(fastest == Approx(5.0).epsilon(0.02));
  CHECK(stationary_s > 4.5);  // the stop on the route and the one at the end
  CHECK(motion.driven_m() == Approx(route_of(PathKind::kSquare, 400.0).length_m()).margin(0.5));
}

TEST_CASE("The car drives off from a stop as it does from the start", "[motion]") {
  std::mt19937_64 random(5);
  const Ground flat(GroundParameters{.slope = {0.0, 0.0}, .relief_m = 0.0, .roughness_m = 0.0},
                    random);
  const Route route = route_of(PathKind::kLine, 160.0);
  for (const double stop_m : {40.0, 57.25, 81.5}) {
    SpeedParameters speed;
    speed.stops = {{stop_m, 6.0}};
    const VehicleMotion motion(route, flat, {}, speed);

    // The step at which the motion behind the stop is that behind the start, moved on.
    constexpr double kStep_s = 0.02;
    const double start_s = speed.standstill_s;
    double least_m = 1.0;
    for (int step = 0; step * kStep_s < motion.duration_s() - start_s - 15.0; ++step) {
      double worst_m = 0.0;
      for (double t = start_s; t < start_s + 6.0 && worst_m < least_m; t += 0.1) {
        const double before_m = motion.at(t).position_m.x();
        const double behind_m = motion.at(t + step * kStep_s).position_m.x();
        worst_m = std::max(worst_m, std::abs(behind_m - before_m - stop_m));
      }
      least_m = std::min(least_m, worst_m);
    }
    CHECK(least_m < 1e-4);
  }
}

TEST_CASE("A perfect inertial unit integrates back to the drive", "[imu]") {
  const VehicleMotion motion = motion_on(PathKind::kFigureEight, 300.0);
  ImuParameters parameters;
  parameters.gyro_noise = parameters.gyro_bias_sigma = parameters.gyro_bias_walk = 0.0;
  parameters.accelerometer_noise = parameters.accelerometer_bias_sigma = 0.0;
  parameters.accelerometer_bias_walk = parameters.scale_sigma = 0.0;
  parameters.vehicle_T_sensor = Eigen::Translation3d(0.7, -0.2, 0.5) *
                                Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized());
  SimulatedImu imu(parameters, 1);

  const auto sensor_at = [&](double t) {
    return motion.at(t).world_T_vehicle() * parameters.vehicle_T_sensor;
  };

  Eigen::Quaterniond attitude(sensor_at(0.0).linear());
  Eigen::Vector3d position = sensor_at(0.0).translation();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  model::ImuSample last = imu.next(motion);
  const Eigen::Vector3d gravity(0.0, 0.0, -kGravity);
  double worst_m = 0.0;
  const double end_s = 80.0;  // the last 58 of them driving

  REQUIRE(motion.duration_s() > end_s);
  while (imu.next_time_s() <= end_s) {
    const double dt = 1.0 / parameters.rate_hz;
    const model::ImuSample sample = imu.next(motion);
    const Eigen::Vector3d turn =
        0.5 * dt * (last.angular_rate_rad_s + sample.angular_rate_rad_s) +
        dt * dt / 12.0 * last.angular_rate_rad_s.cross(sample.angular_rate_rad_s);
    const Eigen::Quaterniond next =
        attitude * Eigen::Quaterniond(Eigen::AngleAxisd(
                       turn.norm(), turn.norm() > 0 ? Eigen::Vector3d(turn.normalized())
                                                    : Eigen::Vector3d::UnitX().eval()));
    const Eigen::Vector3d a0 = attitude * last.specific_force_mps2 + gravity;
    const Eigen::Vector3d a1 = next * sample.specific_force_mps2 + gravity;
    position += dt * velocity + dt * dt / 6.0 * (2.0 * a0 + a1);

    velocity += 0.5 * dt * (a0 + a1);
    attitude = next;
    last = sample;
    worst_m =
        std::max(worst_m, (position - sensor_at(1e-6 * double(sample.utime)).translation()).norm());
  }

  CHECK(worst_m < 0.003);
}

TEST_CASE("The errors of the inertial unit have the size that was asked for", "[imu]") {
  SpeedParameters standing;
  standing.standstill_s = 120.0;
  const Ground level;
  const VehicleMotion motion(route_of(PathKind::kLine, 20.0), level, {}, standing);
  const ImuParameters parameters;
  double gyro_squares = 0.0;
  double bias_squares = 0.0;
  int samples = 0;
  const int units = 40;
  for (int unit = 0; unit < units; ++unit) {
    SimulatedImu imu(parameters, unit);
    bias_squares += imu.gyro_bias().squaredNorm();
    while (imu.next_time_s() < 20.0) {
      const model::ImuSample sample = imu.next(motion);
      gyro_squares += (sample.angular_rate_rad_s - imu.gyro_bias()).squaredNorm();
      ++samples;
    }
  }
  const double gyro_sigma = std::sqrt(gyro_squares / (3.0 * samples));
  CHECK(gyro_sigma == Approx(parameters.gyro_noise * std::sqrt(parameters.rate_hz)).epsilon(0.02));
  CHECK(std::sqrt(bias_squares / (3.0 * units)) ==
        Approx(parameters.gyro_bias_sigma).epsilon(0.25));

  ImuParameters limited;
  limited.accelerometer_limit_mps2 = 5.0;
  SimulatedImu imu(limited, 1);
  CHECK(imu.next(motion).specific_force_mps2.z() == 5.0);
}

TEST_CASE("Wheels and satellites measure what the car does, within their errors", "[sensors]") {
  const VehicleMotion motion = motion_on(PathKind::kCircle, 300.0);
  WheelParameters wheel_parameters;
  SimulatedWheels wheels(wheel_parameters, 3);
  double driven_m = 0.0;
  double steering = 0.0;
  int count = 0;
  while (wheels.next_time_s() < motion.duration_s()) {
    const double t = wheels.next_time_s();
    const model::WheelSample sample = wheels.next(motion);
    if (t < 20.0) CHECK(sample.speed_mps == 0.0);
    driven_m += sample.speed_mps / wheel_parameters.rate_hz;
    if (t > 40.0 && t < 60.0) {
      steering += sample.steering_rad;
      ++count;
    }
  }
  CHECK(driven_m == Approx(motion.driven_m()).epsilon(0.02));
  const double radius = 300.0 / (2.0 * std::numbers::pi);
  CHECK(steering / count == Approx(std::atan(2.7 / radius)).margin(0.012));

  GnssParameters gnss_parameters;
  gnss_parameters.outages = {{30.0, 50.0}};
  SimulatedGnss gnss(gnss_parameters, 3);
  int fixes = 0;
  while (gnss.next_time_s() < motion.duration_s()) {
    const double t = gnss.next_time_s();
    const auto fix = gnss.next(motion);
    CHECK(fix.has_value() == !(t >= 30.0 && t < 50.0));
    if (!fix) continue;
    ++fixes;
    const VehicleState state = motion.at(t);
    CHECK((fix->east_north_m - state.position_m.head<2>()).norm() < 1.0 + 5.0 * fix->sigma_m);
    CHECK((*fix->velocity_mps - state.velocity_mps.head<2>()).norm() < 0.6);
  }
  CHECK(fixes > 50);
}
