// Motion of the vehicle since the last scan, from the available measurements.
#pragma once

#include <optional>

#include "common/geometry/se2.hpp"
#include "common/model/ekf_output.hpp"
#include "common/model/odometry_buffer.hpp"
#include "services/associator/parameters.hpp"

namespace understory::associator {

/// A message earlier than the last one by this time shows that the clock was set back.
inline constexpr model::Utime kClockJump_us = 10'000'000;

/// A predicted motion between two scans.
struct PredictedMotion {
  geometry::SE2WithCovariance last_T_now;
  bool is_extrapolated = false;  ///< No measurement: the last motion is repeated.
};

/// Owns the odometry, the filter's latest pose and the motion between the last two scans.
class MotionPredictor {
 public:
  /// Without any measurement the vehicle is assumed to stand still.
  explicit MotionPredictor(const AssociatorParameters& parameters) : parameters_(parameters) {}

  /// Motion by wheels or IMU. An increment that is not finite is ignored; one that begins 10 s
  /// before the latest one clears the buffer (the clock was set back).
  void add(const model::Odometry& increment);
  /// The filter's pose: its velocity and biases predict the next motion if it belongs to the last
  /// scan. A pose that is not finite is ignored.
  void add(const model::EkfPose& pose);

  /// Time of the last located scan; none at the start.
  const std::optional<model::Utime>& last_scan() const { return last_scan_; }
  /// The motion from the last scan to `utime`: by wheels; else by the filter's velocity with the
  /// IMU or by the IMU alone, whichever has the smaller covariance; else the last motion is
  /// repeated. Precondition: there is a last scan.
  PredictedMotion predict(model::Utime utime) const;
  /// The motion by wheels and gyro alone; none if either is missing.
  std::optional<geometry::SE2WithCovariance> by_wheels(model::Utime from, model::Utime to) const;

  /// Sets the time of a located scan, and the motion since the last one (used if there was one).
  void set_scan(model::Utime utime, const geometry::SE2& last_T_now);
  /// The next scan is taken as the first one.
  void forget_scan() { last_scan_.reset(); }

  /// Members of a saved state; see common/state. The parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.odometry_, self.filter_pose_, self.last_scan_, self.last_interval_s_, self.last_motion_);
  }

 private:
  std::optional<geometry::SE2WithCovariance> measured(model::Utime utime) const;
  std::optional<geometry::SE2WithCovariance> by_filter(model::Utime utime) const;
  geometry::SE2WithCovariance extrapolated(model::Utime utime) const;

  AssociatorParameters parameters_;
  model::OdometryBuffer odometry_;
  std::optional<model::EkfPose> filter_pose_;
  std::optional<model::Utime> last_scan_;
  double last_interval_s_ = 0.1;  ///< Between the last two scans.
  geometry::SE2 last_motion_;     ///< Likewise.
};

}  // namespace understory::associator
