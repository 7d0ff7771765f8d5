#include "services/lidar_imu_input/velocity_reference.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace understory::lidar_imu_input {
namespace {

constexpr double kFastEnough_mps = 2.0;
constexpr double kLongestStep_s = 3.0;
constexpr double kUnknownSigma_m = 2.0;
constexpr double kUnknownSigma_mps = 0.2;
constexpr double kCourseSigma_rad = 0.03;  // of the course against the heading: side slip

/// East, north and sigma.
std::optional<std::pair<Eigen::Vector2d, double>> velocity_of(
    const model::GnssFix& fix, const std::optional<model::GnssFix>& previous) {
  if (fix.velocity_mps) {
    const double sigma = fix.velocity_sigma_mps > 0.0 ? fix.velocity_sigma_mps : kUnknownSigma_mps;
    return std::pair{*fix.velocity_mps, sigma};
  }
  if (!previous) return std::nullopt;
  const double seconds = static_cast<double>(fix.utime - previous->utime) * 1e-6;
  if (seconds <= 0.0 || seconds > kLongestStep_s) return std::nullopt;
  const double sigma = fix.sigma_m > 0.0 ? fix.sigma_m : kUnknownSigma_m;
  const Eigen::Vector2d moved = fix.east_north_m - previous->east_north_m;
  return std::pair{Eigen::Vector2d(moved / seconds), std::sqrt(2.0) * sigma / seconds};
}

}  // namespace

std::optional<ReferenceVelocity> VelocityReference::add(const model::GnssFix& fix,
                                                        double heading_rad) {
  const auto velocity = velocity_of(fix, previous_);
  previous_ = fix;
  if (!velocity) return std::nullopt;

  // Below some speed the course gives no heading.
  const auto& [east_north, sigma] = *velocity;
  const double speed = east_north.norm();
  const bool fast = speed > std::max(kFastEnough_mps, 4.0 * sigma);
  const double course = std::atan2(east_north.y(), east_north.x());
  if (!east_to_odom_rad_ && !fast) return std::nullopt;

  // The rotation between east and odom, as a scalar Kalman filter.
  ReferenceVelocity reference;
  if (fast) {
    const double variance = std::pow(std::hypot(sigma / speed, kCourseSigma_rad), 2);
    if (!east_to_odom_rad_) {
      east_to_odom_rad_ = heading_rad - course;
      east_to_odom_variance_ = variance;
    }
    const double off = std::remainder(heading_rad - course - *east_to_odom_rad_, 2.0 * M_PI);
    const double gain = east_to_odom_variance_ / (east_to_odom_variance_ + variance);
    *east_to_odom_rad_ += gain * off;
    east_to_odom_variance_ *= 1.0 - gain;
    reference.heading_rad = course + *east_to_odom_rad_;
    reference.heading_sigma_rad = std::sqrt(variance + east_to_odom_variance_);
  }

  reference.odom_velocity_mps = Eigen::Rotation2Dd(*east_to_odom_rad_) * east_north;
  reference.sigma_mps = sigma;
  return reference;
}

}  // namespace understory::lidar_imu_input
