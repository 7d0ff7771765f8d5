#include "services/geoslam_mapper/smoothing/stop_bias.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

constexpr double kShortest_s = 1.0;
/// Sigma of the body's rotation about the vertical at either end of a stop; it does not accumulate.
constexpr double kSway_rad = 5e-4;

}  // namespace

void StopBias::add(const model::Odometry& increment) {
  const bool counts = increment.is_stationary && increment.inertial;
  if (counts) {
    const model::Preintegration& inertial = *increment.inertial;
    rotation_rad_ += inertial.yaw_rad + inertial.bias.x() * inertial.seconds;
    variance_ += inertial.covariance(0, 0);
    seconds_ += inertial.seconds;
    if (!was_stationary_) stops_ += 1.0;
  }
  was_stationary_ = counts;
}

std::optional<MeasuredBias> StopBias::measured() const {
  if (seconds_ < kShortest_s) return std::nullopt;
  const double variance = variance_ + 2.0 * stops_ * kSway_rad * kSway_rad;
  return MeasuredBias{rotation_rad_ / seconds_, variance / (seconds_ * seconds_)};
}

}  // namespace understory::geoslam_mapper::smoothing
