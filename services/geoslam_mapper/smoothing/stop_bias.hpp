// What the gyro measures while the vehicle is stationary: its bias.
#pragma once

#include <optional>

#include "common/model/odometry.hpp"
#include "services/geoslam_mapper/smoothing/centre_motion.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Sums up what the gyro shows at stops. A stationary vehicle does not rotate, so its rate is the
/// bias; no landmark and no filter is needed for that.
class StopBias {
 public:
  /// Adds the increment that follows; only those with an IMU from a stationary vehicle count.
  void add(const model::Odometry& increment);
  /// The bias by the stops since the last clear(); none where they lasted less than a second.
  std::optional<MeasuredBias> measured() const;
  /// Forgets what was summed up.
  void clear() { *this = {}; }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.rotation_rad_, self.variance_, self.seconds_, self.stops_, self.was_stationary_);
  }

 private:
  double rotation_rad_ = 0.0;  ///< With the bias in it.
  double variance_ = 0.0;      ///< White noise of that [rad^2].
  double seconds_ = 0.0;
  double stops_ = 0.0;  ///< Number.
  bool was_stationary_ = false;
};

}  // namespace understory::geoslam_mapper::smoothing
