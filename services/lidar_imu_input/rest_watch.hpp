// REST_LEVEL: time of the last rest, and the level error at it, estimated from later motion.
#pragma once

#include <algorithm>
#include <optional>

#include "common/model/odometry.hpp"
#include "services/lidar_imu_input/attitude_filter.hpp"

namespace understory::lidar_imu_input {

/// Owns the times of the last rest, and the last published level.
class RestWatch {
 public:
  /// The vehicle is stationary at `utime`, since `from`.
  void add_stationary(model::Utime from, model::Utime utime);
  /// Corrects the end of the rest to `utime`.
  void go_back(model::Utime utime) { until_ = std::min(until_, utime); }
  /// The attitude filter's estimate of the level at the last rest, if a standard deviation has
  /// changed by a tenth since the last one returned, and once a second at rest.
  std::optional<model::RestLevel> news(model::Utime utime, const AttitudeFilter& attitude);

  /// Members of a saved state; see common/state. The rest is configuration.
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
