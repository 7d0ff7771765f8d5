// REST_LEVEL: when the vehicle was last stationary, and what its motion has shown of the level
// since.
#pragma once

#include <optional>

#include "common/model/odometry.hpp"
#include "services/lidar_imu_input/attitude_filter.hpp"

namespace understory::lidar_imu_input {

/// Owns the times of the last rest, and what was published of its level last.
class RestWatch {
 public:
  /// The vehicle is stationary at `utime`, and has been since `from`.
  void add_stationary(model::Utime from, model::Utime utime);
  /// What the attitude's filter knows of the level at the last rest, where the vehicle has moved
  /// since and this has become better than what was published last by a tenth of its standard
  /// deviation.
  std::optional<model::RestLevel> news(model::Utime utime, const AttitudeFilter& attitude);

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.from_, self.until_, self.published_, self.sequence_);
  }

 private:
  std::optional<model::Utime> from_;  ///< None before the first rest.
  model::Utime until_ = 0;
  Eigen::Matrix2d published_ =
      Eigen::Matrix2d::Zero();  ///< Covariance [rad^2]; zero = nothing yet.
  std::uint64_t sequence_ = 0;
};

}  // namespace understory::lidar_imu_input
