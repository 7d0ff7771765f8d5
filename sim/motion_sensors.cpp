#include "sim/motion_sensors.hpp"

#include <algorithm>
#include <cmath>

#include "sim/hash_random.hpp"

namespace understory::sim {
namespace {

model::Utime utime_at(double time_s, model::Utime utime_of_start) {
  return utime_of_start + static_cast<model::Utime>(std::llround(time_s * 1e6));
}

Eigen::Vector3d limited(const Eigen::Vector3d& value, double limit) {
  return limit > 0.0 ? value.cwiseMin(limit).cwiseMax(-limit).eval() : value;
}

}  // namespace

model::ImuSample true_imu_sample(const VehicleState& state,
                                 const Eigen::Isometry3d& vehicle_T_sensor) {
  const Eigen::Vector3d& rate = state.angular_rate_rad_s;
  const Eigen::Vector3d lever = vehicle_T_sensor.translation();
  const Eigen::Vector3d up(0.0, 0.0, kGravity);
  const Eigen::Vector3d force = state.world_Q_vehicle.conjugate() * (state.acceleration_mps2 + up) +
                                state.angular_acceleration_rad_s2.cross(lever) +
                                rate.cross(rate.cross(lever));
  model::ImuSample sample;
  sample.angular_rate_rad_s = vehicle_T_sensor.linear().transpose() * rate;
  sample.specific_force_mps2 = vehicle_T_sensor.linear().transpose() * force;
  return sample;
}

SimulatedImu::SimulatedImu(const ImuParameters& parameters, std::uint64_t seed)
    : parameters_(parameters), random_(mixed(seed, 0x1301)) {
  gyro_bias_ = normal3(parameters.gyro_bias_sigma);
  accelerometer_bias_ = normal3(parameters.accelerometer_bias_sigma);
  gyro_scale_ = Eigen::Vector3d::Ones() + normal3(parameters.scale_sigma);
  accelerometer_scale_ = Eigen::Vector3d::Ones() + normal3(parameters.scale_sigma);
}

Eigen::Vector3d SimulatedImu::normal3(double sigma) {
  const double x = normal_(random_);
  const double y = normal_(random_);
  return sigma * Eigen::Vector3d(x, y, normal_(random_));
}

model::ImuSample SimulatedImu::next(const VehicleMotion& motion, model::Utime utime_of_start) {
  const double time_s = next_time_s();
  model::ImuSample sample = true_imu_sample(motion.at(time_s), parameters_.vehicle_T_sensor);
  sample.utime = utime_at(time_s, utime_of_start);
  sample.sequence = count_++;
  const double root_dt = 1.0 / std::sqrt(parameters_.rate_hz);
  gyro_bias_ += normal3(parameters_.gyro_bias_walk * root_dt);
  accelerometer_bias_ += normal3(parameters_.accelerometer_bias_walk * root_dt);

  sample.angular_rate_rad_s = gyro_scale_.cwiseProduct(sample.angular_rate_rad_s) + gyro_bias_ +
                              normal3(parameters_.gyro_noise / root_dt);
  sample.specific_force_mps2 = accelerometer_scale_.cwiseProduct(sample.specific_force_mps2) +
                               accelerometer_bias_ +
                               normal3(parameters_.accelerometer_noise / root_dt);
  sample.angular_rate_rad_s = limited(sample.angular_rate_rad_s, parameters_.gyro_limit_rad_s);
  sample.specific_force_mps2 =
      limited(sample.specific_force_mps2, parameters_.accelerometer_limit_mps2);

  return sample;
}

SimulatedWheels::SimulatedWheels(const WheelParameters& parameters, std::uint64_t seed)
    : parameters_(parameters), random_(mixed(seed, 0x3eee1)) {
  scale_ = 1.0 + parameters.scale_sigma * normal_(random_);
  steering_offset_rad_ = parameters.steering_offset_sigma_rad * normal_(random_);
}

model::WheelSample SimulatedWheels::next(const VehicleMotion& motion, model::Utime utime_of_start) {
  const double time_s = next_time_s();
  const VehicleState state = motion.at(time_s);
  const Eigen::Vector3d velocity = state.world_Q_vehicle.conjugate() * state.velocity_mps;
  const double yaw_rate = state.angular_rate_rad_s.z();
  model::WheelSample sample;
  sample.utime = utime_at(time_s, utime_of_start);
  sample.sequence = count_++;

  const double speed = velocity.x() - yaw_rate * parameters_.encoder_left_m;
  const double noise = parameters_.speed_sigma_mps * normal_(random_);
  sample.speed_mps = std::abs(speed) < 1e-3 ? 0.0 : scale_ * speed + noise;
  const double steering =
      std::abs(velocity.x()) < 0.1
          ? 0.0
          : std::atan(motion.parameters().wheelbase_m * yaw_rate / velocity.x());
  sample.steering_rad =
      steering + steering_offset_rad_ + parameters_.steering_sigma_rad * normal_(random_);

  return sample;
}

SimulatedGnss::SimulatedGnss(const GnssParameters& parameters, std::uint64_t seed)
    : parameters_(parameters), random_(mixed(seed, 0x69255)) {
  drift_m_ = normal2(parameters.drift_sigma_m);
}

Eigen::Vector2d SimulatedGnss::normal2(double sigma) {
  const double x = normal_(random_);
  return sigma * Eigen::Vector2d(x, normal_(random_));
}

std::optional<model::GnssFix> SimulatedGnss::next(const VehicleMotion& motion,
                                                  model::Utime utime_of_start) {
  const double time_s = next_time_s();
  ++count_;
  const double kept = std::exp(-1.0 / (parameters_.rate_hz * parameters_.drift_time_s));
  drift_m_ = kept * drift_m_ + normal2(parameters_.drift_sigma_m * std::sqrt(1.0 - kept * kept));
  const Eigen::Vector2d noise = normal2(parameters_.sigma_m);
  const Eigen::Vector2d velocity_noise = normal2(parameters_.velocity_sigma_mps);
  const auto& outages = parameters_.outages;

  if (std::any_of(outages.begin(), outages.end(), [&](const GnssParameters::Outage& outage) {
        return time_s >= outage.from_s && time_s < outage.to_s;
      })) {
    return std::nullopt;
  }

  const VehicleState state = motion.at(time_s);
  const Eigen::Vector3d lever = state.world_Q_vehicle * parameters_.antenna_m;
  const Eigen::Vector3d turning =
      state.world_Q_vehicle * state.angular_rate_rad_s.cross(parameters_.antenna_m);
  model::GnssFix fix;
  fix.utime = utime_at(time_s, utime_of_start);
  fix.sequence = fixes_++;
  fix.east_north_m = (state.position_m + lever).head<2>() + drift_m_ + noise;
  fix.sigma_m = std::hypot(parameters_.sigma_m, parameters_.drift_sigma_m);
  fix.velocity_mps = (state.velocity_mps + turning).head<2>() + velocity_noise;
  fix.velocity_sigma_mps = parameters_.velocity_sigma_mps;

  return fix;
}

}  // namespace understory::sim
