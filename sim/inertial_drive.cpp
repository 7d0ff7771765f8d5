#include "sim/inertial_drive.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/random_streams.hpp"

namespace understory::sim {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

Eigen::Matrix2d rotation(double angle) { return geometry::SE2(0.0, 0.0, angle).rotation(); }

/// Adds one IMU sample: constant rate and force over `dt`, the force in the frame at mid-rotation.
void integrate(model::Preintegration& p, double rate, const Eigen::Vector2d& force, double dt,
               double gyro_noise, double accelerometer_noise) {
  const double yaw = rate * dt;
  const Eigen::Matrix2d to_start = rotation(p.yaw_rad + 0.5 * yaw);
  const Eigen::Vector2d acceleration = to_start * force;
  const Eigen::Vector2d sideways = geometry::perpendicular(acceleration);
  Eigen::Matrix<double, 5, 5> step = Eigen::Matrix<double, 5, 5>::Identity();
  step.block<2, 1>(1, 0) = sideways * dt;
  step.block<2, 1>(3, 0) = 0.5 * sideways * dt * dt;
  step.block<2, 2>(3, 1) = dt * Eigen::Matrix2d::Identity();
  Eigen::Matrix<double, 5, 3> input = Eigen::Matrix<double, 5, 3>::Zero();  // Of (rate, force).
  input(0, 0) = dt;
  input.block<2, 1>(1, 0) = 0.5 * sideways * dt * dt;
  input.block<2, 1>(3, 0) = 0.25 * sideways * dt * dt * dt;
  input.block<2, 2>(1, 1) = to_start * dt;
  input.block<2, 2>(3, 1) = 0.5 * to_start * dt * dt;

  const double gyro = gyro_noise * gyro_noise / dt;
  const double accelerometer = accelerometer_noise * accelerometer_noise / dt;
  const Eigen::Matrix3d noise = Eigen::Vector3d(gyro, accelerometer, accelerometer).asDiagonal();
  p.covariance = step * p.covariance * step.transpose() + input * noise * input.transpose();
  p.bias_jacobian = step * p.bias_jacobian - input;
  p.position_m += p.velocity_mps * dt + 0.5 * acceleration * dt * dt;
  p.velocity_mps += acceleration * dt;
  p.yaw_rad += yaw;
  p.seconds += dt;
}

}  // namespace

TrunkField make_trunk_field(const ForestParameters& parameters, std::uint64_t seed) {
  std::mt19937_64 random = random_stream(seed, Stream::kForest);
  TrunkField world;
  world.forest = make_forest(parameters, random);
  world.grid = std::make_unique<PointGrid>(world.forest.trunks_m, 10.0);
  return world;
}

InertialDrive::InertialDrive(const InertialDriveParameters& parameters, const TrunkField& world,
                             std::uint64_t seed)
    : parameters_(parameters),
      world_(world),
      shared_(parameters.shared, seed, seed),
      random_(random_stream(seed, Stream::kObservation)) {
  std::uniform_real_distribution<double> angle(0.0, kTwoPi);
  progress_.phase_rad = angle(random_);
  body_.theta_rad = angle(random_);

  // The loop lies around the middle of the forest.
  const double radius = parameters_.loop_length_m / kTwoPi;
  const Eigen::Vector2d middle = 0.5 * (world.forest.low_m + world.forest.high_m);
  body_.position_m =
      middle + radius * Eigen::Vector2d(std::sin(body_.theta_rad), -std::cos(body_.theta_rad));
  bias_ << parameters_.gyro_bias_sigma * normal(), parameters_.accelerometer_bias_sigma * normal(),
      parameters_.accelerometer_bias_sigma * normal();

  sway_.parked = body_.pose();
  if (sways()) {
    const geometry::SE2 first = sway_place();
    body_.position_m = first.translation();
    body_.theta_rad = first.theta();
    body_.velocity_mps = sway_velocity();
  }
}

InertialDrive::Tick InertialDrive::Body::move(double dt, double yaw_rad,
                                              const Eigen::Vector2d& velocity_mps_after) {
  Tick tick;
  tick.yaw_rad = yaw_rad;
  const double mid = theta_rad + 0.5 * yaw_rad;
  theta_rad += yaw_rad;
  tick.acceleration_mps2 = rotation(-mid) * (velocity_mps_after - velocity_mps) / dt;
  position_m += 0.5 * (velocity_mps_after + velocity_mps) * dt;
  velocity_mps = velocity_mps_after;
  rate_rad_s = yaw_rad / dt;
  return tick;
}

/// Whether the body sways until the next scan.
bool InertialDrive::sways() const {
  const InertialDriveParameters& p = parameters_;
  const bool is_stationary = progress_.time_s + p.scan_interval_s < p.stationary_s + 1e-6;
  return is_stationary &&
         (p.sway_sigma_m > 0.0 || p.sway_sigma_rad > 0.0 || p.sway_sigma_mps > 0.0);
}

geometry::SE2 InertialDrive::sway_place() {
  const double x = parameters_.sway_sigma_m * normal();
  const double y = parameters_.sway_sigma_m * normal();
  return sway_.parked * geometry::SE2(x, y, parameters_.sway_sigma_rad * normal());
}

Eigen::Vector2d InertialDrive::sway_velocity() {
  const double x = parameters_.sway_sigma_mps * normal();
  return {x, parameters_.sway_sigma_mps * normal()};
}

/// Accelerations that bring the body to a new random position and velocity of its sway at the next
/// scan.
void InertialDrive::begin_sway() {
  const geometry::SE2 next = sway_place();
  const Eigen::Vector2d velocity = sway_velocity();
  const double half = 0.5 * parameters_.scan_interval_s;

  // With accelerations a, b over the halves: velocity + (a + b) half, and
  // displacement + (1.5 a + 0.5 b) half^2.
  const Eigen::Vector2d sum = (velocity - body_.velocity_mps) / half;
  const Eigen::Vector2d displacement =
      next.translation() - body_.position_m - 2.0 * half * body_.velocity_mps;
  sway_.push.col(0) = displacement / (half * half) - 0.5 * sum;
  sway_.push.col(1) = sum - sway_.push.col(0);
  sway_.rate_rad_s =
      geometry::wrap_angle(next.theta() - body_.theta_rad) / parameters_.scan_interval_s;
}

InertialDrive::Tick InertialDrive::sway(double dt, bool first_half) {
  progress_.time_s += dt;
  Tick tick = body_.move(dt, sway_.rate_rad_s * dt,
                         body_.velocity_mps + sway_.push.col(first_half ? 0 : 1) * dt);
  walk_bias(dt);
  return tick;
}

InertialDrive::Tick InertialDrive::advance(double dt) {
  const InertialDriveParameters& p = parameters_;
  progress_.time_s += dt;

  // The speed follows its target within the acceleration limit.
  const double moving = progress_.time_s - p.stationary_s;
  const double wanted =
      moving <= 0.0 ? 0.0 : p.speed_mps * (1.0 + p.speed_swing * std::sin(0.4 * moving));
  const double change = p.acceleration_mps2 * dt;
  double& speed = progress_.speed_mps;
  speed = std::clamp(wanted, speed - change, speed + change);

  // The heading follows the loop and its bends.
  const double length = speed * dt;
  const double curvature =
      kTwoPi / p.loop_length_m +
      p.wiggle_curvature *
          std::sin(progress_.phase_rad + kTwoPi * progress_.driven_m / p.wiggle_length_m);
  const double heading = body_.theta_rad + length * curvature;
  Tick tick = body_.move(dt, length * curvature,
                         speed * Eigen::Vector2d(std::cos(heading), std::sin(heading)));
  progress_.driven_m += length;
  walk_bias(dt);
  return tick;
}

void InertialDrive::walk_bias(double dt) {
  bias_.x() += parameters_.gyro_walk * std::sqrt(dt) * normal();
  bias_.y() += parameters_.accelerometer_walk * std::sqrt(dt) * normal();
  bias_.z() += parameters_.accelerometer_walk * std::sqrt(dt) * normal();
}

/// Drives to the next scan and integrates the IMU's samples of `dt`.
model::Preintegration InertialDrive::drive_samples(double dt) {
  const InertialDriveParameters& p = parameters_;
  const bool swaying = sways();
  if (swaying) begin_sway();

  const double gyro_noise = p.true_noise_factor * p.gyro_noise / std::sqrt(dt);
  const double force_noise = p.true_noise_factor * p.accelerometer_noise / std::sqrt(dt);
  model::Preintegration inertial;
  for (int k = 0; k < p.samples_per_scan; ++k) {
    const model::InertialBias bias = bias_;
    const Tick tick = swaying ? sway(dt, 2 * k < p.samples_per_scan) : advance(dt);
    const double rate = tick.yaw_rad / dt + bias.x() + gyro_noise * normal();
    Eigen::Vector2d force = tick.acceleration_mps2 + bias.tail<2>();
    force.x() += force_noise * normal();
    force.y() += force_noise * normal();
    integrate(inertial, rate, force, dt, p.gyro_noise, p.accelerometer_noise);
  }
  return inertial;
}

model::Odometry InertialDrive::drive_increment() {
  const InertialDriveParameters& p = parameters_;
  const geometry::SE2 before = body_.pose();
  const model::Preintegration inertial = drive_samples(p.scan_interval_s / p.samples_per_scan);
  const geometry::SE2 truth = before.inverse() * body_.pose();

  // Accuracy of the increment with the sensors on board.
  const bool wheels = p.odometry != OdometryKind::kInertial;
  const bool imu = p.odometry != OdometryKind::kWheels;
  const double sigma = wheels ? p.wheel_sigma_m : p.dead_reckoning_sigma_mps * p.scan_interval_s;
  const double rotation_sigma =
      imu ? std::sqrt(inertial.covariance(0, 0)) + p.gyro_bias_sigma * p.scan_interval_s
          : p.wheel_sigma_rad;

  model::Odometry increment;
  increment.is_stationary = progress_.speed_mps <= 0.0;
  increment.has_wheels = wheels;
  if (imu) increment.inertial = inertial;

  // Its error; stationary wheels have none.
  const double moved = increment.is_stationary && wheels ? 0.0 : p.true_noise_factor;
  const Eigen::Vector3d error(sigma * moved * normal(), sigma * moved * normal(),
                              imu ? 0.0 : rotation_sigma * moved * normal());
  increment.from_T_to = truth * geometry::SE2::Exp(error);
  if (imu) increment.from_T_to = geometry::SE2(increment.from_T_to.translation(), inertial.yaw_rad);
  increment.covariance =
      Eigen::Vector3d(sigma * sigma, sigma * sigma, rotation_sigma * rotation_sigma).asDiagonal();
  return increment;
}

void InertialDrive::observe(DriveStep& step) {
  const InertialDriveParameters& p = parameters_;
  const geometry::SE2 vehicle_T_world = step.world_T_vehicle.inverse();
  std::bernoulli_distribution detected(p.detection_probability);
  const double variance = p.position_sigma_m * p.position_sigma_m;
  const double true_sigma_m = p.true_noise_factor * p.position_sigma_m;

  const auto add = [&](const Eigen::Vector2d& position, std::int64_t trunk) {
    model::Detection detection;
    detection.position_m << position, 0.0;
    detection.covariance_m2 = Eigen::Vector3d::Constant(variance).asDiagonal();
    detection.radius_m = 0.15;
    step.scan.detections.push_back(detection);
    step.trunks.push_back(trunk);
  };

  const auto near = world_.grid->within(step.world_T_vehicle.translation(), p.range_m);
  for (const std::uint32_t trunk : near) {
    if (!detected(random_) || shared_.is_missed(trunk)) continue;
    const Eigen::Vector2d noise(normal(), normal());
    const Eigen::Vector2d place = vehicle_T_world * world_.forest.trunks_m[trunk];
    Eigen::Vector2d shown = place + true_sigma_m * noise;
    if (p.shared.any()) shown += shared_.error_m(trunk, place, step.world_T_vehicle, step.driven_m);
    add(shown, trunk);
  }

  std::poisson_distribution<int> clutter(
      std::max(1e-9, p.clutter_share * p.detection_probability * static_cast<double>(near.size())));
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const int false_ones = p.clutter_share > 0.0 ? clutter(random_) : 0;

  for (int k = 0; k < false_ones; ++k) {
    const double range = p.range_m * std::sqrt(unit(random_));
    const double bearing = kTwoPi * unit(random_);
    add(range * Eigen::Vector2d(std::cos(bearing), std::sin(bearing)), -1);
  }
}

DriveStep InertialDrive::next() {
  DriveStep step;
  const auto interval_us =
      static_cast<model::Utime>(std::llround(1e6 * parameters_.scan_interval_s));
  const model::Utime utime = static_cast<model::Utime>(scans_) * interval_us;

  if (scans_ > 0) {
    model::Odometry increment = drive_increment();
    increment.from_utime = utime - interval_us;
    increment.utime = utime;
    increment.sequence = scans_ - 1;
    if (parameters_.odometry != OdometryKind::kNone) step.odometry.push_back(increment);
  }

  step.world_T_vehicle = body_.pose();
  step.velocity_mps = body_.velocity_mps;
  step.rate_rad_s = body_.rate_rad_s;
  step.bias = bias_;
  step.driven_m = progress_.driven_m;
  step.scan.utime = utime;
  step.scan.sequence = scans_++;
  step.scan.field_of_view.max_range_m = parameters_.range_m;

  observe(step);
  return step;
}

}  // namespace understory::sim
