// REST_LEVEL: when the vehicle was last stationary, and what its motion has shown of the level
// since.
#pragma once

#include <algorithm>
#include <optional>

#include "common/model/odometry.hpp"
#include "services/lidar_imu_input/attitude_filter.hpp"

namespace understory::lidar_imu_input {

/// Owns the times of the last rest, and what was published of its level last.
class RestWatch {
 public:
  /// The vehicle is stationary at `utime`, and has been since `from`.
  void add_stationary(model::Utime from, model::Utime utime);
  /// The vehicle was stationary until `utime` only.
  void go_back(model::Utime utime) { until_ = std::min(until_, utime); }
  /// What the attitude's filter knows of the level at the last rest, where a standard deviation has
  /// changed by a tenth since the last call that gave something, and once a second at rest.
  std::optional<model::RestLevel> news(model::Utime utime, const AttitudeFilter& attitude);

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.from_, self.until_, self.published_, self.sequence_);
  }

 private:
  std::optional<model::Utime> from_;  ///< None before the first rest.
  model::Utime until_ = 0;
  model::RestLevel published_;  ///< The last one.
  std::uint64_t sequence_ = 0;
};

}  // namespace understory::lidar_imu_input
