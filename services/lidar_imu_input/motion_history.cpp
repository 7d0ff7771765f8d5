#include "services/lidar_imu_input/motion_history.hpp"

#include <algorithm>
#include <cmath>

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

/// The state extrapolated to another time at its own velocity and rate.
MotionState moved_on(const MotionState& state, model::Utime utime) {
  MotionState moved = state;
  const double seconds = seconds_between(state.utime, utime);
  const Eigen::Vector3d rotation = state.rate_rad_s * seconds;
  moved.utime = utime;
  moved.position_m += state.odom_Q_vehicle * (state.velocity_mps * seconds);
  if (rotation.norm() > 1e-12) {
    moved.odom_Q_vehicle = state.odom_Q_vehicle * Eigen::Quaterniond(Eigen::AngleAxisd(
                                                      rotation.norm(), rotation.normalized()));
  }
  moved.heading_rad += rotation.z();
  return moved;
}

/// Time over which the motion after the first state is measured.
constexpr model::Utime kBaseline_us = 100'000;

}  // namespace

void MotionHistory::add(const MotionState& state) {
  states_.push_back(state);
  while (seconds_between(states_.front().utime, state.utime) > kKept_s) states_.pop_front();
}

std::optional<MotionState> MotionHistory::at(model::Utime utime) const {
  if (states_.empty()) return std::nullopt;
  const auto after = std::ranges::lower_bound(states_, utime, {}, &MotionState::utime);
  if (after == states_.end() || after == states_.begin()) {
    const MotionState& nearest = after == states_.end() ? states_.back() : states_.front();
    if (std::abs(seconds_between(nearest.utime, utime)) > kMostExtrapolation_s) return std::nullopt;
    return after == states_.end() ? moved_on(nearest, utime) : before_first(utime);
  }

  const MotionState& a = *std::prev(after);
  const MotionState& b = *after;
  const double share = seconds_between(a.utime, utime) / seconds_between(a.utime, b.utime);
  const auto interpolate = [share](const auto& from, const auto& to) {
    return (from + share * (to - from)).eval();
  };

  MotionState state = a;
  state.utime = utime;
  state.odom_Q_vehicle = a.odom_Q_vehicle.slerp(share, b.odom_Q_vehicle);
  state.position_m = interpolate(a.position_m, b.position_m);
  state.velocity_mps = interpolate(a.velocity_mps, b.velocity_mps);
  state.level_velocity_mps = interpolate(a.level_velocity_mps, b.level_velocity_mps);
  state.rate_rad_s = interpolate(a.rate_rad_s, b.rate_rad_s);
  state.heading_rad =
      a.heading_rad + share * std::remainder(b.heading_rad - a.heading_rad, 2.0 * M_PI);
  return state;
}

/// At the first state the velocity was unknown, so the motion before it is extrapolated from the
/// motion shortly after. The velocity in the result stays that of the first state.
MotionState MotionHistory::before_first(model::Utime utime) const {
  const MotionState& first = states_.front();
  if (states_.size() < 2) return moved_on(first, utime);
  auto b = std::ranges::lower_bound(states_, first.utime + kBaseline_us, {}, &MotionState::utime);
  if (b == states_.end()) --b;
  const MotionState& a = *std::prev(b);
  const double seconds = seconds_between(a.utime, b->utime);
  const Eigen::Quaterniond back = a.odom_Q_vehicle.conjugate();
  const Eigen::AngleAxisd rotation(back * b->odom_Q_vehicle);

  MotionState moving = first;
  moving.velocity_mps = back * (b->position_m - a.position_m) / seconds;
  moving.rate_rad_s = rotation.angle() / seconds * rotation.axis();
  MotionState moved = moved_on(moving, utime);
  moved.velocity_mps = first.velocity_mps;
  moved.rate_rad_s = first.rate_rad_s;
  return moved;
}

}  // namespace understory::lidar_imu_input
