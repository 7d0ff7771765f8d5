#include "sim/inertial_drive.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/random_streams.hpp"

namespace understory::sim {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

Eigen::Matrix2d rotation(double angle) { return geometry::SE2(0.0, 0.0, angle).rotation(); }

/// Adds one IMU sample: rate and force held over `dt`, the force in the frame at mid-turn.
void integrate(model::Preintegration& p, double rate, const Eigen::Vector2d& force, double dt,
               double gyro_noise, double accelerometer_noise) {
  const double turn = rate * dt;
  const Eigen::Matrix2d to_start = rotation(p.yaw_rad + 0.5 * turn);
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

  p.yaw_rad += turn;
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
    : parameters_(parameters), world_(world), random_(random_stream(seed, Stream::kObservation)) {
  std::uniform_real_distribution<double> angle(0.0, kTwoPi);
  phase_ = angle(random_);
  theta_ = angle(random_);

  // The loop lies around the middle of the forest.
  const double radius = parameters_.loop_length_m / kTwoPi;
  const Eigen::Vector2d middle = 0.5 * (world.forest.low_m + world.forest.high_m);
  position_ = middle + radius * Eigen::Vector2d(std::sin(theta_), -std::cos(theta_));
  bias_ << parameters_.gyro_bias_sigma * normal(), parameters_.accelerometer_bias_sigma * normal(),
      parameters_.accelerometer_bias_sigma * normal();
  parked_ = geometry::SE2(position_, theta_);

  if (sways()) {
    const geometry::SE2 first = sway_place();
    position_ = first.translation();
    theta_ = first.theta();
    velocity_ = sway_velocity();
  }
}

/// Whether the body sways until the next scan.
bool InertialDrive::sways() const {
  const InertialDriveParameters& p = parameters_;
  const bool is_stationary = time_s_ + p.scan_interval_s < p.standing_s + 1e-6;
  return is_stationary &&
         (p.sway_sigma_m > 0.0 || p.sway_sigma_rad > 0.0 || p.sway_sigma_mps > 0.0);
}

geometry::SE2 InertialDrive::sway_place() {
  const double x = parameters_.sway_sigma_m * normal();
  const double y = parameters_.sway_sigma_m * normal();
  return parked_ * geometry::SE2(x, y, parameters_.sway_sigma_rad * normal());
}

Eigen::Vector2d InertialDrive::sway_velocity() {
  const double x = parameters_.sway_sigma_mps * normal();
  return {x, parameters_.sway_sigma_mps * normal()};
}

/// Pushes by which the body is at a place and a velocity of its sway when the next scan comes.
void InertialDrive::begin_sway() {
  const geometry::SE2 next = sway_place();
  const Eigen::Vector2d velocity = sway_velocity();
  const double half = 0.5 * parameters_.scan_interval_s;
  // With pushes a, b over the halves: velocity + (a + b) half, and way + (1.5 a + 0.5 b) half^2.
  const Eigen::Vector2d sum = (velocity - velocity_) / half;
  const Eigen::Vector2d way = next.translation() - position_ - 2.0 * half * velocity_;
  sway_push_.col(0) = way / (half * half) - 0.5 * sum;
  sway_push_.col(1) = sum - sway_push_.col(0);
  sway_rate_ = geometry::wrap_angle(next.theta() - theta_) / parameters_.scan_interval_s;
}

InertialDrive::Tick InertialDrive::sway(double dt, bool first_half) {
  time_s_ += dt;
  Tick tick =
      turn_and_push(dt, sway_rate_ * dt, velocity_ + sway_push_.col(first_half ? 0 : 1) * dt);
  walk_bias(dt);
  return tick;
}

/// One sample's motion, after which the vehicle has turned and has this velocity.
InertialDrive::Tick InertialDrive::turn_and_push(double dt, double yaw_rad,
                                                 const Eigen::Vector2d& velocity_mps) {
  Tick tick;
  tick.yaw_rad = yaw_rad;
  const double mid = theta_ + 0.5 * yaw_rad;
  theta_ += yaw_rad;
  tick.acceleration_mps2 = rotation(-mid) * (velocity_mps - velocity_) / dt;
  position_ += 0.5 * (velocity_mps + velocity_) * dt;
  velocity_ = velocity_mps;
  return tick;
}

InertialDrive::Tick InertialDrive::advance(double dt) {
  time_s_ += dt;
  const double moving = time_s_ - parameters_.standing_s;
  const double wanted =
      moving <= 0.0
          ? 0.0
          : parameters_.speed_mps * (1.0 + parameters_.speed_swing * std::sin(0.4 * moving));
  const double change = parameters_.acceleration_mps2 * dt;
  speed_mps_ = std::clamp(wanted, speed_mps_ - change, speed_mps_ + change);
  const double length = speed_mps_ * dt;
  const double curvature = kTwoPi / parameters_.loop_length_m +
                           parameters_.wiggle_curvature *
                               std::sin(phase_ + kTwoPi * driven_m_ / parameters_.wiggle_length_m);

  const double heading = theta_ + length * curvature;
  Tick tick = turn_and_push(dt, length * curvature,
                            speed_mps_ * Eigen::Vector2d(std::cos(heading), std::sin(heading)));
  driven_m_ += length;
  walk_bias(dt);

  return tick;
}

void InertialDrive::walk_bias(double dt) {
  bias_.x() += parameters_.gyro_walk * std::sqrt(dt) * normal();
  bias_.y() += parameters_.accelerometer_walk * std::sqrt(dt) * normal();
  bias_.z() += parameters_.accelerometer_walk * std::sqrt(dt) * normal();
}

model::Odometry InertialDrive::drive_increment() {
  const InertialDriveParameters& p = parameters_;
  const double dt = p.scan_interval_s / p.samples_per_scan;
  const geometry::SE2 before(position_, theta_);
  const bool swaying = sways();
  if (swaying) begin_sway();
  model::Preintegration inertial;

  for (int k = 0; k < p.samples_per_scan; ++k) {
    const model::InertialBias bias = bias_;
    const Tick tick = swaying ? sway(dt, 2 * k < p.samples_per_scan) : advance(dt);
    const double rate = tick.yaw_rad / dt + bias.x() + p.gyro_noise / std::sqrt(dt) * normal();
    Eigen::Vector2d force = tick.acceleration_mps2 + bias.tail<2>();
    force.x() += p.accelerometer_noise / std::sqrt(dt) * normal();
    force.y() += p.accelerometer_noise / std::sqrt(dt) * normal();
    integrate(inertial, rate, force, dt, p.gyro_noise, p.accelerometer_noise);
  }

  const geometry::SE2 truth = before.inverse() * geometry::SE2(position_, theta_);
  const bool wheels = p.odometry != OdometryKind::kInertial;
  const bool imu = p.odometry != OdometryKind::kWheels;
  const double sigma = wheels ? p.wheel_sigma_m : p.dead_reckoning_sigma_mps * p.scan_interval_s;
  const double turn_sigma =
      imu ? std::sqrt(inertial.covariance(0, 0)) + p.gyro_bias_sigma * p.scan_interval_s
          : p.wheel_sigma_rad;
  model::Odometry increment;
  increment.is_stationary = speed_mps_ <= 0.0;

  increment.has_wheels = wheels;
  if (imu) increment.inertial = inertial;
  const double moved = increment.is_stationary && wheels ? 0.0 : 1.0;
  const Eigen::Vector3d error(sigma * moved * normal(), sigma * moved * normal(),
                              imu ? 0.0 : turn_sigma * moved * normal());
  increment.from_T_to = truth * geometry::SE2::Exp(error);
  if (imu) increment.from_T_to = geometry::SE2(increment.from_T_to.translation(), inertial.yaw_rad);
  increment.covariance =
      Eigen::Vector3d(sigma * sigma, sigma * sigma, turn_sigma * turn_sigma).asDiagonal();

  return increment;
}

void InertialDrive::observe(DriveStep& step) {
  const InertialDriveParameters& p = parameters_;
  const geometry::SE2 vehicle_T_world = step.world_T_vehicle.inverse();
  std::bernoulli_distribution detected(p.detection_probability);
  const double variance = p.position_sigma_m * p.position_sigma_m;

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
    if (!detected(random_)) continue;
    const Eigen::Vector2d noise(normal(), normal());
    add(vehicle_T_world * world_.forest.trunks_m[trunk] + p.position_sigma_m * noise, trunk);
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

  step.world_T_vehicle = geometry::SE2(position_, theta_);
  step.velocity_mps = velocity_;
  step.bias = bias_;
  step.driven_m = driven_m_;
  step.scan.utime = utime;
  step.scan.sequence = scans_++;
  step.scan.field_of_view.max_range_m = parameters_.range_m;

  observe(step);
  return step;
}

}  // namespace understory::sim
