#include "services/lidar_imu_input/gravity_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "services/lidar_imu_input/attitude_filter.hpp"
#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr std::size_t kFewestQuiet = 5;
/// Of an accelerometer's scale and bias together.
constexpr double kScaleTolerance = 0.1;
/// A smaller mean is no gravity [m/s^2].
constexpr double kNoGravity_mps2 = 0.5;
/// Steeper than any slope on which a vehicle stands.
constexpr double kSteepest_rad = 30.0 * std::numbers::pi / 180.0;

bool is_near(double value, double expected) {
  return std::abs(value - expected) <= kScaleTolerance * expected;
}

double angle_from_upwards(const Eigen::Vector3d& force) {
  return std::atan2(force.head<2>().norm(), force.z());
}

}  // namespace

bool GravityCheck::add(const model::ImuSample& raw) {
  window_.push_back(raw);
  window_.back().specific_force_mps2 *= scale_;
  if (seconds_between(window_.front().utime, raw.utime) < quiet_.window_s) return false;

  const bool is_whole = seconds_between(window_.front().utime, raw.utime) < 2.0 * quiet_.window_s;
  const bool was_in_g = verdict_ == GravityVerdict::kInG;
  if (is_whole && is_quiet()) {
    mean_mps2_.setZero();
    for (const model::ImuSample& sample : window_)
      mean_mps2_ += sample.specific_force_mps2 / static_cast<double>(window_.size());
    verdict_ = judge();
    if (verdict_ == GravityVerdict::kInG) scale_ = kGravity_mps2;
    if (was_in_g && verdict_ == GravityVerdict::kRight) verdict_ = GravityVerdict::kInG;
  }
  window_.clear();
  return verdict_ == GravityVerdict::kInG && !was_in_g;
}

bool GravityCheck::is_quiet() const {
  if (window_.size() < kFewestQuiet) return false;
  Eigen::Array<double, 6, 1> sum = Eigen::Array<double, 6, 1>::Zero();
  Eigen::Array<double, 6, 1> squares = sum;
  for (const model::ImuSample& sample : window_) {
    Eigen::Array<double, 6, 1> value;
    value << sample.angular_rate_rad_s.array(), sample.specific_force_mps2.array();
    sum += value;
    squares += value.square();
  }

  const auto count = static_cast<double>(window_.size());
  const Eigen::Array<double, 6, 1> mean = sum / count;
  const Eigen::Array<double, 6, 1> sigma = (squares / count - mean.square()).max(0.0).sqrt();
  // With a wrong unit the noise has that unit, too.
  const double unit = std::max(1.0, mean.tail<3>().matrix().norm() / kGravity_mps2);
  return sigma.head<3>().maxCoeff() <= quiet_.gyro_sigma_rad_s &&
         mean.head<3>().abs().maxCoeff() <= quiet_.gyro_mean_rad_s &&
         sigma.tail<3>().maxCoeff() <= quiet_.force_sigma_mps2 * unit;
}

GravityVerdict GravityCheck::judge() const {
  const double norm_mps2 = mean_mps2_.norm();
  if (is_near(norm_mps2, 1.0)) return GravityVerdict::kInG;
  if (norm_mps2 < kNoGravity_mps2) return GravityVerdict::kMissing;
  if (!is_near(norm_mps2, kGravity_mps2)) return GravityVerdict::kWrongScale;

  const double off_rad = angle_from_upwards(mount_.rotation() * mean_mps2_);
  if (off_rad <= kSteepest_rad) return GravityVerdict::kRight;
  return off_rad >= std::numbers::pi - kSteepest_rad ? GravityVerdict::kPointsDown
                                                     : GravityVerdict::kTilted;
}

std::string GravityCheck::text() const {
  using enum GravityVerdict;
  // Called with every sample.
  if (verdict_ == kUnknown || verdict_ == kRight || verdict_ == kInG) return "";

  const Eigen::Vector3d& f = mean_mps2_;
  const std::string mending =
      fmt::format("imu.mount roll_rad = {:.2f}, pitch_rad = {:.2f} would make it upwards",
                  std::atan2(f.y(), f.z()), std::atan2(-f.x(), f.tail<2>().norm()));

  switch (verdict_) {
    case GravityVerdict::kPointsDown:
      return "at rest the force points down: the IMU is upside down (" + mending +
             "), or its driver has turned the sign of the acceleration round";
    case GravityVerdict::kTilted:
      return fmt::format("at rest the force is {:.0f} deg off upwards: the mounting is wrong ({})",
                         angle_from_upwards(mount_.rotation() * f) * 180.0 / std::numbers::pi,
                         mending);
    case GravityVerdict::kMissing:
      return fmt::format(
          "at rest the force is {:.2f} m/s^2: its driver has taken gravity out and "
          "must send the specific force with it",
          f.norm());
    case GravityVerdict::kWrongScale:
      return fmt::format(
          "at rest the force is {:.2f} m/s^2 and not 9.81: its driver's unit is wrong", f.norm());
    default:
      return "";
  }
}

}  // namespace understory::lidar_imu_input
