#include "services/ekf/timeline.hpp"

namespace understory::ekf {
namespace {

/// Squared distance of an increment over its variance, above which a stationary vehicle cannot have
/// made it.
constexpr double kMoves = 50.0;

}  // namespace

double seconds(model::Utime duration_us) { return 1e-6 * static_cast<double>(duration_us); }
model::Utime microseconds(double duration_s) { return static_cast<model::Utime>(1e6 * duration_s); }

Timeline::Timeline(double wait_s, double clock_jump_s)
    : wait_us_(microseconds(wait_s)), clock_jump_us_(microseconds(clock_jump_s)) {}

bool Timeline::may_begin(const model::Odometry& increment) {
  if (!first_odometry_ || increment.utime < *first_odometry_)
    first_odometry_ = increment.from_utime;
  if (!increment.inertial || increment.is_stationary) return true;
  if (increment.utime - *first_odometry_ > wait_us_) return true;
  const double spread = increment.covariance.topLeftCorner<2, 2>().trace();
  return increment.has_wheels && increment.from_T_to.translation().squaredNorm() > kMoves * spread;
}

void Timeline::begin(model::Utime utime) {
  has_begun_ = true;
  first_odometry_.reset();
  now_ = utime;
}

Interval Timeline::interval_of(const model::Odometry& increment) const {
  if (increment.utime <= now_ + kTolerance_us) return Interval::kPast;
  if (increment.from_utime < now_ - kTolerance_us) return Interval::kOverlaps;
  if (increment.from_utime > now_ + kTolerance_us) return Interval::kAfterGap;
  return Interval::kFollows;
}

StampOrder Timeline::order_of_scan(model::Utime utime) const {
  if (last_scan_ && utime < *last_scan_ - clock_jump_us_) return StampOrder::kClockJumpedBack;
  const bool is_repeated = last_scan_ && utime <= *last_scan_;
  return is_repeated || utime < now_ - kTolerance_us ? StampOrder::kLate : StampOrder::kInOrder;
}

}  // namespace understory::ekf
