#include "services/ekf/odometry_queue.hpp"

#include <cmath>

namespace understory::ekf {
namespace {

bool is_usable(const model::Preintegration& p) {
  return std::isfinite(p.yaw_rad) && p.velocity_mps.allFinite() && p.position_m.allFinite() &&
         p.covariance.allFinite() && p.covariance.diagonal().minCoeff() >= 0.0 &&
         p.bias_jacobian.allFinite() && p.bias.allFinite() && p.level.covariance.allFinite() &&
         p.level.memory.allFinite() && p.level.added.allFinite() &&
         std::isfinite(p.level.pitch_tangent);
}

}  // namespace

bool is_usable(const model::Odometry& increment) {
  return increment.utime > increment.from_utime && increment.from_T_to.coordinates().allFinite() &&
         increment.covariance.allFinite() && increment.covariance.diagonal().minCoeff() >= 0.0 &&
         (!increment.inertial || is_usable(*increment.inertial));
}

OdometryQueue::OdometryQueue(double max_delay_s, double clock_jump_s)
    : max_delay_us_(microseconds(max_delay_s)), clock_jump_us_(microseconds(clock_jump_s)) {}

StampOrder OdometryQueue::order_of(const model::Odometry& increment, model::Utime now) const {
  const model::Utime newest = increments_.empty() ? now : increments_.back().utime;
  if (increment.utime < newest - clock_jump_us_) return StampOrder::kClockJumpedBack;
  if (increment.from_utime < newest - kTolerance_us) return StampOrder::kLate;
  return StampOrder::kInOrder;
}

void OdometryQueue::push(const model::Odometry& increment) { increments_.push_back(increment); }

std::optional<model::Odometry> OdometryQueue::take_ended_by(model::Utime utime) {
  if (increments_.empty() || increments_.front().utime > utime + kTolerance_us) return std::nullopt;
  const model::Odometry oldest = increments_.front();
  increments_.pop_front();
  return oldest;
}

std::optional<model::Utime> OdometryQueue::overdue() const {
  if (increments_.empty()) return std::nullopt;
  const model::Utime limit = increments_.back().utime - max_delay_us_;
  if (increments_.front().utime > limit) return std::nullopt;
  return limit;
}

}  // namespace understory::ekf
