#include "services/lidar_imu_input/standstill.hpp"

#include <algorithm>
#include <cmath>

namespace understory::lidar_imu_input {
namespace {

constexpr int kFloorWindows = 200;  // windows for the IMU's noise at rest
constexpr std::size_t kFewestSamples = 5;

/// Mean and spread over a window.
struct Spread {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double sigma = 0.0;  ///< Of the worst axis.
};

template <class Get>
Spread spread_of(const std::deque<model::ImuSample>& window, const Get& get) {
  Spread spread;
  for (const model::ImuSample& sample : window) spread.mean += get(sample);
  spread.mean /= static_cast<double>(window.size());
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  for (const model::ImuSample& sample : window) squares += (get(sample) - spread.mean).cwiseAbs2();
  spread.sigma = std::sqrt(squares.maxCoeff() / static_cast<double>(window.size()));
  return spread;
}

}  // namespace

void StandstillDetector::add_wheel_speed(model::Utime utime, double speed_mps) {
  if (std::abs(speed_mps) <= parameters_.wheel_speed_mps) return;
  wheels_turned_ = utime;
  has_turned_ = true;
  is_stationary_ = false;
}

bool StandstillDetector::wheels_turn(model::Utime now) const {
  return has_turned_ && static_cast<double>(now - wheels_turned_) * 1e-6 < parameters_.window_s;
}

bool StandstillDetector::is_quiet(const std::optional<Eigen::Vector3d>& gyro_bias) {
  const Spread gyro = spread_of(
      window_, [](const model::ImuSample& s) -> const auto& { return s.angular_rate_rad_s; });
  const Spread force = spread_of(
      window_, [](const model::ImuSample& s) -> const auto& { return s.specific_force_mps2; });

  // Limits: this IMU's noise at rest, once it is known.
  const bool floor_known = floor_windows_ >= kFloorWindows;
  const double most_gyro = floor_known ? std::min(parameters_.gyro_sigma_rad_s,
                                                  parameters_.floor_factor * gyro_floor_ + 1e-4)
                                       : parameters_.gyro_sigma_rad_s;
  const double most_force = floor_known ? std::min(parameters_.force_sigma_mps2,
                                                   parameters_.floor_factor * force_floor_ + 1e-3)
                                        : parameters_.force_sigma_mps2;

  // With a known bias the limit is narrow: a slow, smooth curve is no standstill.
  const Eigen::Vector3d rate = gyro.mean - gyro_bias.value_or(Eigen::Vector3d::Zero());
  const double most_rate =
      gyro_bias ? 0.1 * parameters_.gyro_mean_rad_s : parameters_.gyro_mean_rad_s;
  const bool quiet = gyro.sigma <= most_gyro && force.sigma <= most_force &&
                     rate.cwiseAbs().maxCoeff() <= most_rate;

  if (quiet && !floor_known) {
    ++floor_windows_;
    gyro_floor_ += (gyro.sigma - gyro_floor_) / floor_windows_;
    force_floor_ += (force.sigma - force_floor_) / floor_windows_;
  }
  return quiet;
}

void StandstillDetector::add(const model::ImuSample& sample,
                             const std::optional<Eigen::Vector3d>& gyro_bias,
                             bool may_be_stationary) {
  window_.push_back(sample);
  const auto length = [this] {
    return static_cast<double>(window_.back().utime - window_.front().utime) * 1e-6;
  };
  while (window_.size() > 2 && length() > parameters_.window_s) window_.pop_front();

  const bool full = window_.size() >= kFewestSamples && length() > 0.8 * parameters_.window_s;
  const bool is_stationary =
      full && may_be_stationary && !wheels_turn(sample.utime) && is_quiet(gyro_bias);
  if (is_stationary && !is_stationary_) since_ = window_.front().utime;
  is_stationary_ = is_stationary;
  if (is_stationary) longest_s_ = std::max(longest_s_, stationary_s());
}

double StandstillDetector::stationary_s() const {
  return is_stationary_ ? static_cast<double>(window_.back().utime - since_) * 1e-6 : 0.0;
}

void StandstillDetector::reset() {
  window_.clear();
  is_stationary_ = false;
}

}  // namespace understory::lidar_imu_input
