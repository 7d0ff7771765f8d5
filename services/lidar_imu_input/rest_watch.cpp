#include "services/lidar_imu_input/rest_watch.hpp"

#include <algorithm>

namespace understory::lidar_imu_input {
namespace {

/// Ratio of variances that triggers a message: a standard deviation changed by a tenth,
constexpr double kTenth = 0.81;
/// or a second of rest has passed [us].
constexpr model::Utime kEvery = 1'000'000;
/// 0.05 mm at breast height [rad^2].
constexpr double kLeast_rad2 = 1.6e-9;

bool is_other(double now, double before) { return now < kTenth * before || before < kTenth * now; }

/// Effect of the error at rest on the vehicle's present position [rad^2].
double size_of(const model::RestLevel& level) {
  return std::max(kLeast_rad2, std::min(level.covariance.trace(), level.change_covariance.trace()));
}

}  // namespace

void RestWatch::add_stationary(model::Utime from, model::Utime utime) {
  from_ = from;
  until_ = utime;
}

std::optional<model::RestLevel> RestWatch::news(model::Utime utime,
                                                const AttitudeFilter& attitude) {
  if (!from_ || utime < *from_) return std::nullopt;
  const RestTilt& rest = attitude.rest();
  // The IMU may be ahead of `utime`.
  model::RestLevel level{utime,
                         sequence_,
                         *from_,
                         std::min(until_, utime),
                         rest.error_rad,
                         rest.covariance,
                         attitude.tilt_change_covariance()};

  const bool is_new = published_.rest_from_utime != *from_;
  const bool goes_on =
      level.rest_utime > published_.rest_utime && utime - published_.utime >= kEvery;
  const bool is_better = rest.covariance.trace() < kTenth * published_.covariance.trace();
  if (!is_new && !goes_on && !is_better && !is_other(size_of(level), size_of(published_)))
    return std::nullopt;
  published_ = level;
  ++sequence_;
  return level;
}

}  // namespace understory::lidar_imu_input
