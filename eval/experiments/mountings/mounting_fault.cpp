#include "eval/experiments/mountings/mounting_fault.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace understory::eval::experiments::mountings {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kGravity_mps2 = 9.81;

using Random = std::mt19937_64;

double between(double low, double high, Random& random) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
/// Small and large values alike.
double any_size(double low, double high, Random& random) {
  return std::exp(between(std::log(low), std::log(high), random));
}
double any_sign(Random& random) { return random() % 2 == 0 ? 1.0 : -1.0; }

Eigen::Matrix3d turned(double degrees, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(degrees * kDegree, axis).toRotationMatrix();
}
Eigen::Matrix3d scaled(double factor) { return factor * Eigen::Matrix3d::Identity(); }
Eigen::Matrix3d mirrored(int axis) {
  Eigen::Matrix3d result = Eigen::Matrix3d::Identity();
  result(axis, axis) = -1.0;
  return result;
}

/// A sensor that is turned by R against its configuration measures R^T times what it should.
void turn_imu(MountingFault& fault, double degrees, int axis) {
  fault.rate = fault.force = turned(-degrees, Eigen::Vector3d::Unit(axis));
  fault.value = fmt::format("{:.0f} deg about {}", degrees, "xyz"[axis]);
}
void turn_lidar(MountingFault& fault, double degrees, int axis) {
  fault.points = turned(-degrees, Eigen::Vector3d::Unit(axis));
  fault.value = fmt::format("{:.1f} deg about {}", degrees, "xyz"[axis]);
}
void scale_points(MountingFault& fault, double factor) {
  fault.points = scaled(factor);
  fault.value = fmt::format("times {:.3g}", factor);
}
void scale_speed(MountingFault& fault, double factor) {
  fault.speed = factor;
  fault.value = fmt::format("times {:.3g}", factor);
}
void shift_lidar(MountingFault& fault, double metres, double heading_rad) {
  fault.shift_m = metres * Eigen::Vector3d(std::cos(heading_rad), std::sin(heading_rad), 0.0);
  fault.value = fmt::format("{:.2f} m towards {:.0f} deg", metres, heading_rad / kDegree);
}

struct Kind {
  const char* name;
  Culprit culprit;
  std::function<void(MountingFault&, Random&)> draw;
};

const std::vector<Kind>& kinds() {
  using enum Culprit;
  using F = MountingFault;
  using R = Random;
  static const std::vector<Kind> all = {
      {"IMU turned by 90 or 180 deg", kImu,
       [](F& f, R& r) {
         const double degrees = 90.0 * static_cast<double>(1 + r() % 3);
         turn_imu(f, degrees, static_cast<int>(r() % 3));
       }},
      {"IMU yaw 5 to 180 deg", kImu,
       [](F& f, R& r) { turn_imu(f, any_sign(r) * any_size(5.0, 180.0, r), 2); }},
      {"gyro in deg/s", kImu, [](F& f, R&) { f.rate = scaled(1.0 / kDegree); }},
      {"gyro's sign", kImu, [](F& f, R&) { f.rate = scaled(-1.0); }},
      {"acceleration in g", kImu, [](F& f, R&) { f.force = scaled(1.0 / kGravity_mps2); }},
      {"acceleration's sign", kImu, [](F& f, R&) { f.force = scaled(-1.0); }},
      {"LIDAR yaw 2 to 10 deg", kLidar,
       [](F& f, R& r) { turn_lidar(f, any_sign(r) * between(2.0, 10.0, r), 2); }},
      {"LIDAR yaw 10 to 180 deg", kLidar,
       [](F& f, R& r) { turn_lidar(f, any_sign(r) * any_size(10.0, 180.0, r), 2); }},
      {"LIDAR upside down", kLidar,
       [](F& f, R& r) { turn_lidar(f, 180.0, static_cast<int>(r() % 2)); }},
      {"LIDAR roll or pitch 5 to 20 deg", kLidar,
       [](F& f, R& r) {
         const double degrees = any_sign(r) * between(5.0, 20.0, r);
         turn_lidar(f, degrees, static_cast<int>(r() % 2));
       }},
      {"LIDAR 0.3 to 2 m beside its place", kLidar,
       [](F& f, R& r) {
         const double heading_rad = between(-std::numbers::pi, std::numbers::pi, r);
         shift_lidar(f, between(0.3, 2.0, r), heading_rad);
       }},
      {"ranges in mm", kLidar, [](F& f, R&) { scale_points(f, 1000.0); }},
      {"ranges 2 to 10 % too long", kLidar,
       [](F& f, R& r) { scale_points(f, between(1.02, 1.1, r)); }},
      {"points mirrored left to right", kLidar, [](F& f, R&) { f.points = mirrored(1); }},
      {"elevations mirrored", kLidar, [](F& f, R&) { f.points = mirrored(2); }},
      {"laser said to turn the other way", kLidar, [](F& f, R&) { f.reversed_times = true; }},
      {"rings counted from above", kLidar, [](F& f, R&) { f.reversed_rings = true; }},
      {"sweeps stamped 20 to 200 ms off", kLidar,
       [](F& f, R& r) {
         f.late_s = any_sign(r) * between(0.02, 0.2, r);
         f.value = fmt::format("{:+.0f} ms", 1e3 * f.late_s);
       }},
      {"wheel speed in km/h", kWheels, [](F& f, R&) { scale_speed(f, 3.6); }},
      {"wheel speed's sign", kWheels, [](F& f, R&) { scale_speed(f, -1.0); }},
      {"wheel radius 2 to 10 % off", kWheels,
       [](F& f, R& r) {
         const double share = any_sign(r) * between(0.02, 0.1, r);
         scale_speed(f, 1.0 + share);
       }},
      {"wheel ticks halved", kWheels, [](F& f, R&) { scale_speed(f, 0.5); }},
      {"left and right wheel swapped", kWheels, [](F& f, R&) { f.steering = -1.0; }},
  };
  return all;
}

}  // namespace

std::string to_string(Culprit culprit) {
  switch (culprit) {
    case Culprit::kImu:
      return "IMU";
    case Culprit::kLidar:
      return "LIDAR";
    case Culprit::kWheels:
      return "wheels";
    case Culprit::kNone:
      break;
  }
  return "none";
}

void apply(const MountingFault& fault, model::ImuSample& sample) {
  sample.angular_rate_rad_s = fault.rate * sample.angular_rate_rad_s;
  sample.specific_force_mps2 = fault.force * sample.specific_force_mps2;
}

void apply(const MountingFault& fault, model::WheelSample& sample) {
  sample.speed_mps *= fault.speed;
  sample.steering_rad *= fault.steering;
}

void apply(const MountingFault& fault, model::PointSweep& sweep) {
  sweep.utime += static_cast<model::Utime>(std::llround(1e6 * fault.late_s));
  if (sweep.points.empty()) return;
  const float first_s = sweep.points.front().time_s;
  const float last_s = sweep.points.back().time_s;
  const Eigen::Matrix3f points = fault.points.cast<float>();
  const Eigen::Vector3f shift_m = fault.shift_m.cast<float>();

  for (model::SweepPoint& point : sweep.points) {
    const Eigen::Vector3f moved = points * point.position() + shift_m;
    point.x_m = moved.x();
    point.y_m = moved.y();
    point.z_m = moved.z();
    if (fault.reversed_times) point.time_s = first_s + last_s - point.time_s;
    if (fault.reversed_rings) point.ring = static_cast<std::uint16_t>(sweep.rings - 1 - point.ring);
  }
  if (fault.reversed_times) std::ranges::reverse(sweep.points);
}

std::vector<std::string> mounting_kinds() {
  std::vector<std::string> names;
  for (const Kind& kind : kinds()) names.emplace_back(kind.name);
  return names;
}

MountingFault draw_fault(const std::string& kind, std::mt19937_64& random) {
  const auto found =
      std::ranges::find_if(kinds(), [&](const Kind& one) { return one.name == kind; });
  if (found == kinds().end()) throw std::invalid_argument("no such fault: " + kind);
  MountingFault fault;
  fault.culprit = found->culprit;
  fault.kind = kind;
  found->draw(fault, random);
  return fault;
}

}  // namespace understory::eval::experiments::mountings
