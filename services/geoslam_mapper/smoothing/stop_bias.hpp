// The gyro's bias, measured while the vehicle is stationary.
#pragma once

#include <optional>

#include "common/model/odometry.hpp"
#include "services/geoslam_mapper/smoothing/centre_motion.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Sums up the gyro's rotation during stops. A stationary vehicle does not rotate, so its rate is
/// the bias; neither landmarks nor a filter are needed.
class StopBias {
 public:
  /// Adds the next increment; only those of a stationary vehicle with an IMU count.
  void add(const model::Odometry& increment);
  /// The bias from the stops since the last clear(); none if they lasted less than a second.
  std::optional<MeasuredBias> measured() const;
  /// Clears the sums.
  void clear() { *this = {}; }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.rotation_rad_, self.variance_, self.seconds_, self.stops_, self.was_stationary_);
  }

 private:
  double rotation_rad_ = 0.0;  ///< Including the bias.
  double variance_ = 0.0;      ///< White noise of rotation_rad_ [rad^2].
  double seconds_ = 0.0;
  double stops_ = 0.0;  ///< Number of stops.
  bool was_stationary_ = false;
};

}  // namespace understory::geoslam_mapper::smoothing
