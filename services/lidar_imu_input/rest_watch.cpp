#include "services/lidar_imu_input/rest_watch.hpp"

namespace understory::lidar_imu_input {
namespace {

/// A standard deviation that is smaller by a tenth is worth a message.
constexpr double kBetter = 0.81;

}  // namespace

void RestWatch::add_stationary(model::Utime from, model::Utime utime) {
  from_ = from;
  until_ = utime;
  published_.setZero();
}

std::optional<model::RestLevel> RestWatch::news(model::Utime utime,
                                                const AttitudeFilter& attitude) {
  if (!from_ || utime <= until_) return std::nullopt;
  const RestTilt& rest = attitude.rest();
  const Eigen::Matrix2d& before = published_.isZero(0.0) ? rest.at_rest : published_;
  if (rest.covariance.trace() > kBetter * before.trace()) return std::nullopt;
  published_ = rest.covariance;
  return model::RestLevel{utime, sequence_++, *from_, until_, rest.error_rad, rest.covariance};
}

}  // namespace understory::lidar_imu_input
