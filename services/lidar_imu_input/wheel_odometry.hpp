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
  /// Distance of the encoder's wheel to the left of the rear axle's middle [m].
  double encoder_left_m = 0.76;
  /// Frame `vehicle` in the frame of the rear axle's middle.
  geometry::SE2 axle_T_vehicle;
};

/// Errors of the wheels. Those of scale and steering are correlated over time: they are given as a
/// standard deviation and a correlation time, and modelled as white noise of the same power.
/// Motions over that time or longer then have consistent covariances when intervals are compounded
/// as independent; shorter ones have too large a covariance, never too small.
struct WheelNoise {
  double speed_scale_sigma = 0.02;       ///< Of the measured speed; wheel radius, slip.
  double steering_sigma_rad = 0.006;     ///< Zero point and play of the steering.
  double steering_scale_sigma = 0.04;    ///< Of the measured steering angle.
  double side_slip_sigma = 0.01;         ///< Sideways velocity, relative to the speed.
  double correlation_time_s = 5.0;       ///< Correlation time of the errors above.
  double stamp_sigma_s = 0.005;          ///< Of each interval's ends relative to the wheels' clock.
  double standstill_sigma_m = 0.001;     ///< Per square root of a second.
  double standstill_sigma_rad = 0.0002;  ///< Per square root of a second.
};

/// Geometry and noise of a car with wheel sensors.
struct WheelOdometryParameters {
  CarGeometry car;
  WheelNoise noise;
  /// A sample is valid until the next one, but for at most this time [s].
  double max_gap_s = 0.5;
};

/// Speed of the rear axle's middle [m/s], from that of the encoder's wheel, which is slower in a
/// turn to its own side.
double axle_speed(const CarGeometry& car, double encoder_speed_mps, double steering_rad);

/// Relative motion of frame `vehicle` between stamps, from speed and steering alone. Samples and
/// stamps come in order of time.
class WheelOdometry {
 public:
  /// Defaults: the Victoria Park car.
  explicit WheelOdometry(const WheelOdometryParameters& parameters = {})
      : parameters_(parameters) {}

  /// Adds a sample; one not later than its predecessor is ignored and counted.
  void add(const model::WheelSample& sample);
  /// The motion of `vehicle` from the previous stamp to this one. None at the first stamp, if the
  /// stamp is not later than the previous one, and if samples are missing in between; the next
  /// interval starts at `stamp` in any case.
  std::optional<model::Odometry> advance_to(model::Utime stamp);

  /// Number of ignored samples.
  std::uint64_t samples_out_of_order() const { return out_of_order_; }
  /// Number of intervals without motion.
  std::uint64_t intervals_without_samples() const { return without_samples_; }

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.samples_, self.last_stamp_, self.sequence_, self.out_of_order_, self.without_samples_);
  }

 private:
  std::optional<geometry::SE2WithCovariance> integrate(model::Utime from, model::Utime to);
  geometry::SE2WithCovariance step(const model::WheelSample& sample, double seconds) const;

  WheelOdometryParameters parameters_;
  std::deque<model::WheelSample> samples_;  ///< From the valid one at `last_stamp_` on.
  std::optional<model::Utime> last_stamp_;
  std::uint64_t sequence_ = 0;
  std::uint64_t out_of_order_ = 0;
  std::uint64_t without_samples_ = 0;
};

}  // namespace understory::lidar_imu_input
