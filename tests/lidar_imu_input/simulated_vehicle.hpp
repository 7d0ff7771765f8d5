// A vehicle whose motion is known in closed form, and what its sensors say.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "common/model/imu.hpp"
#include "common/model/point_sweep.hpp"
#include "common/model/wheels.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::test {

inline double seconds(model::Utime utime) { return static_cast<double>(utime) * 1e-6; }

/// Stands for `stand_s`, then drives: speed and heading swing, the body pitches and rolls.
struct Drive {
  double stand_s = 22.0;
  double top_speed_mps = 8.0;
  double turn_rad_s = 0.25;
  double tilt_rad = 0.05;
  double rough_rad = 0.004;  ///< Of fast small motion.

  double moving(double t) const { return std::max(0.0, t - stand_s); }
  double speed(double t) const {
    const double s = moving(t);
    const double ramp = 1.0 - std::exp(-s * s / 8.0);
    return top_speed_mps * ramp * (0.75 + 0.25 * std::cos(0.35 * s));
  }
  double heading(double t) const {
    const double s = moving(t);
    return turn_rad_s / 0.2 * (1.0 - std::cos(0.2 * s)) + 0.02 * s * s / (1.0 + s);
  }
  double pitch(double t) const {
    const double s = moving(t);
    const double ramp = 1.0 - std::exp(-s * s / 8.0);
    return 0.02 + ramp * (tilt_rad * std::sin(0.5 * s) + rough_rad * std::sin(9.0 * s));
  }
  double roll(double t) const {
    const double s = moving(t);
    const double ramp = 1.0 - std::exp(-s * s / 8.0);
    return -0.03 + ramp * (tilt_rad * std::sin(0.37 * s + 1.0) - tilt_rad * std::sin(1.0) +
                           rough_rad * std::sin(11.0 * s));
  }

  Eigen::Quaterniond rotation(double t) const {
    return Eigen::Quaterniond(Eigen::AngleAxisd(heading(t), Eigen::Vector3d::UnitZ()) *
                              Eigen::AngleAxisd(pitch(t), Eigen::Vector3d::UnitY()) *
                              Eigen::AngleAxisd(roll(t), Eigen::Vector3d::UnitX()));
  }
  Eigen::Vector3d velocity(double t) const {
    return rotation(t) * Eigen::Vector3d(speed(t), 0.0, 0.0);
  }
  Eigen::Vector3d rate(double t) const {
    constexpr double h = 1e-4;
    const Eigen::AngleAxisd turn(rotation(t - h).conjugate() * rotation(t + h));
    return turn.axis() * turn.angle() / (2.0 * h);
  }
  Eigen::Vector3d force(double t) const {
    constexpr double h = 1e-4;
    const Eigen::Vector3d acceleration = (velocity(t + h) - velocity(t - h)) / (2.0 * h);
    return rotation(t).conjugate() * (acceleration + Eigen::Vector3d(0.0, 0.0, 9.81));
  }
};

/// Positions along a drive, integrated once (Simpson, 1 ms).
class Track {
 public:
  Track(const Drive& drive, double length_s) : drive_(drive), positions_{Eigen::Vector3d::Zero()} {
    for (double t = 0.0; t < length_s; t += kStep_s) {
      positions_.emplace_back(positions_.back() +
                              kStep_s / 6.0 *
                                  (drive.velocity(t) + 4.0 * drive.velocity(t + 0.5 * kStep_s) +
                                   drive.velocity(t + kStep_s)));
    }
  }
  Eigen::Isometry3d pose(double t) const {
    const auto i = std::min(positions_.size() - 1, static_cast<std::size_t>(t / kStep_s + 1e-9));
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = drive_.rotation(t).toRotationMatrix();
    pose.translation() =
        positions_[i] + drive_.velocity(t) * (t - static_cast<double>(i) * kStep_s);
    return pose;
  }
  geometry::SE2 planar(double t) const {
    const Eigen::Isometry3d at = pose(t);
    return {Eigen::Vector2d(at.translation().head<2>()), drive_.heading(t)};
  }

 private:
  static constexpr double kStep_s = 1e-3;
  Drive drive_;
  std::vector<Eigen::Vector3d> positions_;
};

struct SensorErrors {
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_bias = Eigen::Vector3d::Zero();
  double gyro_noise = 0.0;   ///< [rad/s/sqrt(Hz)]
  double force_noise = 0.0;  ///< [m/s^2/sqrt(Hz)]
  double wheel_scale = 1.0;
  double wheel_noise_mps = 0.0;
};

/// Of a usual IMU and wheels, drawn; the accelerometer's bias with this standard deviation [m/s^2].
inline SensorErrors usual_errors(std::mt19937_64& random, double force_bias_sigma = 0.015) {
  std::normal_distribution<double> normal;
  SensorErrors errors;
  errors.gyro_noise = 3e-4;
  errors.force_noise = 4e-3;
  for (int axis = 0; axis < 3; ++axis) {
    errors.gyro_bias(axis) = 0.005 * normal(random);
    errors.force_bias(axis) = force_bias_sigma * normal(random);
  }
  errors.wheel_scale = 1.0 + 0.01 * normal(random);
  errors.wheel_noise_mps = 0.03;
  return errors;
}

inline model::ImuSample imu_at(const Drive& drive, model::Utime utime, double rate_hz,
                               const SensorErrors& errors, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const auto noise = [&](double density) {
    return Eigen::Vector3d(Eigen::Vector3d::NullaryExpr(
        [&](Eigen::Index) { return density * std::sqrt(rate_hz) * normal(random); }));
  };
  model::ImuSample sample;
  sample.utime = utime;
  sample.angular_rate_rad_s =
      drive.rate(seconds(utime)) + errors.gyro_bias + noise(errors.gyro_noise);
  sample.specific_force_mps2 =
      drive.force(seconds(utime)) + errors.force_bias + noise(errors.force_noise);
  return sample;
}

/// Encoder in the middle of the axle, which is where the frame `vehicle` is.
inline model::WheelSample wheels_at(const Drive& drive, model::Utime utime,
                                    const SensorErrors& errors, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  model::WheelSample sample;
  sample.utime = utime;
  const double speed = drive.speed(seconds(utime));
  sample.speed_mps =
      errors.wheel_scale * speed + (speed > 0.0 ? errors.wheel_noise_mps * normal(random) : 0.0);
  return sample;
}

inline lidar_imu_input::LidarImuInputParameters parameters_for_drive() {
  lidar_imu_input::LidarImuInputParameters parameters;
  parameters.wheels.car.encoder_left_m = 0.0;
  return parameters;
}

/// One turn of 0.1 s: posts around the vehicle, each point where the sensor saw it.
inline model::PointSweep sweep_at(const Track& track, model::Utime start,
                                  const Eigen::Isometry3d& vehicle_T_sensor,
                                  const std::vector<Eigen::Vector3d>& world_points) {
  model::PointSweep sweep;
  sweep.utime = start;
  sweep.rings = 1;
  sweep.max_range_m = 100.0;
  for (std::size_t i = 0; i < world_points.size(); ++i) {
    const double after =
        0.1 * static_cast<double>(i) / static_cast<double>(world_points.size() - 1);
    const Eigen::Vector3d p =
        (track.pose(seconds(start) + after) * vehicle_T_sensor).inverse() * world_points[i];
    model::SweepPoint point;
    point.x_m = static_cast<float>(p.x());
    point.y_m = static_cast<float>(p.y());
    point.z_m = static_cast<float>(p.z());
    point.time_s = static_cast<float>(after);
    sweep.points.push_back(point);
  }
  return sweep;
}

}  // namespace understory::test
