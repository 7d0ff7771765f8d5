// Dead reckoning of a car from wheel speed and steering.
#pragma once

#include <deque>
#include <optional>

#include "common/geometry/se2.hpp"
#include "common/model/odometry.hpp"
#include "common/model/wheels.hpp"

namespace understory::lidar_imu_input {

/// A car with Ackermann steering; defaults: the Victoria Park car.
struct CarGeometry {
  double wheelbase_m = 2.83;  ///< From axle to axle.
  /// How far the encoder's wheel is left of the middle of the rear axle [m].
  double encoder_left_m = 0.76;
  /// Frame `vehicle` seen from the middle of the rear axle.
  geometry::SE2 axle_T_vehicle;
};

/// Errors of the wheels. Those of scale and steering are correlated over time: they are given as a
/// standard deviation and a correlation time, and counted as white noise of the same power. Motions
/// over that time or longer then have consistent covariances when intervals are compounded as
/// independent; shorter ones have too large a covariance, never too small.
struct WheelNoise {
  double speed_scale_sigma = 0.02;       ///< Of the measured speed; wheel radius, slip.
  double steering_sigma_rad = 0.006;     ///< Zero point and play of the steering.
  double steering_scale_sigma = 0.04;    ///< Of the measured steering angle.
  double side_slip_sigma = 0.01;         ///< Sideways, of the speed.
  double correlation_time_s = 5.0;       ///< How long the errors above last.
  double stamp_sigma_s = 0.005;          ///< Of each interval's ends against the wheels' clock.
  double standstill_sigma_m = 0.001;     ///< Per square root of a second.
  double standstill_sigma_rad = 0.0002;  ///< Per square root of a second.
};

/// Geometry and noise of a car with wheel sensors.
struct WheelOdometryParameters {
  CarGeometry car;
  WheelNoise noise;
  /// A sample holds until the next one, but for no longer than this [s].
  double max_gap_s = 0.5;
};

/// Speed of the middle of the rear axle [m/s], from that of the encoder's wheel: that is slower in
/// a turn to its own side.
double axle_speed(const CarGeometry& car, double encoder_speed_mps, double steering_rad);

/// Relative motion of frame `vehicle` between stamps, from speed and steering alone. Samples and
/// stamps come in order of time.
class WheelOdometry {
 public:
  /// Defaults: the Victoria Park car.
  explicit WheelOdometry(const WheelOdometryParameters& parameters = {})
      : parameters_(parameters) {}

  /// Takes a sample; one that does not come after its predecessor is ignored and counted.
  void add(const model::WheelSample& sample);
  /// The motion of `vehicle` from the previous stamp to this one. None at the first stamp, when the
  /// stamp does not come after the previous one, and when samples are missing in between; the next
  /// interval starts at `stamp` all the same.
  std::optional<model::Odometry> advance_to(model::Utime stamp);

  /// Samples that were ignored.
  std::uint64_t samples_out_of_order() const { return out_of_order_; }
  /// Intervals for which no motion could be given.
  std::uint64_t intervals_without_samples() const { return without_samples_; }

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.samples_, self.last_stamp_, self.sequence_, self.out_of_order_, self.without_samples_);
  }

 private:
  std::optional<geometry::SE2WithCovariance> integrate(model::Utime from, model::Utime to);
  geometry::SE2WithCovariance step(const model::WheelSample& sample, double seconds) const;

  WheelOdometryParameters parameters_;
  std::deque<model::WheelSample> samples_;  ///< From the one in force at `last_stamp_` on.
  std::optional<model::Utime> last_stamp_;
  std::uint64_t sequence_ = 0;
  std::uint64_t out_of_order_ = 0;
  std::uint64_t without_samples_ = 0;
};

}  // namespace understory::lidar_imu_input
