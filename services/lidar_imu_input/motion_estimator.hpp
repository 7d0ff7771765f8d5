// The vehicle's motion without landmarks, and the dead reckoning, which the filter may correct.
#pragma once

#include <deque>
#include <optional>

#include "common/model/ekf_output.hpp"
#include "common/model/gnss.hpp"
#include "common/model/imu.hpp"
#include "common/model/odometry.hpp"
#include "services/lidar_imu_input/levelling.hpp"
#include "services/lidar_imu_input/lever_compensation.hpp"
#include "services/lidar_imu_input/motion_increments.hpp"
#include "services/lidar_imu_input/pose_track.hpp"
#include "services/lidar_imu_input/rest_watch.hpp"
#include "services/lidar_imu_input/stationary_monitor.hpp"
#include "services/lidar_imu_input/vehicle_constraints.hpp"
#include "services/lidar_imu_input/velocity_corrections.hpp"
#include "services/lidar_imu_input/velocity_reference.hpp"
#include "services/lidar_imu_input/wheel_speeds.hpp"

namespace understory::lidar_imu_input {

/// Passes each sample of IMU, wheels and GNSS to attitude, standstill detection, dead reckoning and
/// the integration of ODOMETRY. Values are finite and stamps per sensor advance: `InputGuard`
/// ensures that. Cost: some microseconds per sample.
class MotionEstimator {
 public:
  /// Starts with unknown motion.
  explicit MotionEstimator(const LidarImuInputParameters& parameters);

  /// The sample in frame vehicle, transformed to its origin; stamps must advance.
  model::ImuSample to_vehicle(const model::ImuSample& sensor_sample);
  /// Adds a sample from to_vehicle(). `is_saturated`: the samples before it were omitted since a
  /// sensor was at the end of its range.
  void add_imu(const model::ImuSample& vehicle_sample, bool is_saturated);
  /// Adds speed and steering. Attitude and velocity are those of the latest IMU sample: a sample
  /// more than `imu.max_gap_s` later corrects them when the IMU has reached its time.
  void add_wheels(const model::WheelSample& sample);
  /// Adds a fix: ignored unless `gnss_aided`.
  void add_gnss(const model::GnssFix& fix);
  /// False: it is late and is applied at the next sample.
  bool add_correction(const model::VelocityCorrection& correction);

  /// Sets the start of the first interval of odometry.
  void begin(model::Utime utime) { increments_.begin(utime); }
  /// Motion between two stamps that samples have reached; intervals in order. None if samples are
  /// missing.
  std::optional<model::Odometry> increment(model::Utime from, model::Utime to);

  /// A new estimate of the level at the last rest, after an increment up to `utime`; none without
  /// news.
  std::optional<model::RestLevel> rest_news(model::Utime utime);

  /// Motion during the last seconds.
  const MotionHistory& history() const { return pose_.history(); }
  /// Pose of the dead reckoning in `odom` with its covariance.
  model::RawPose raw_pose() const { return pose_.raw_pose(parameters_.gnss_aided); }
  /// Whether the vehicle stands still at the latest IMU sample.
  bool is_stationary() const { return stationary_.is_stationary(); }
  /// Whether the vehicle was stationary long enough to determine the gyro's bias.
  bool is_calibrated() const { return stationary_.is_calibrated(); }
  /// None before the first IMU sample.
  const std::optional<AttitudeFilter>& attitude() const { return levelling_.attitude(); }
  /// Whether a loaded state is consistent: an attitude requires the samples it was propagated to.
  bool is_whole() const;

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.lever_, self.levelling_, self.stationary_, self.pose_, self.speeds_, self.constraints_,
      self.reference_, self.corrections_, self.increments_, self.rest_, self.ahead_);
  }

 private:
  void start(const model::ImuSample& sample);
  void propagate(const model::ImuSample& sample, bool is_saturated, double seconds);
  void bridge_gap(const model::ImuSample& sample);
  std::optional<WheelScale> wheel_scale() const;
  double middle_speed(const model::WheelSample& sample, const MotionState* then) const;
  void correct_by_wheels(const model::WheelSample& sample, const MotionState& then);
  void correct_by_wheels_reached(const model::ImuSample& sample);
  void go_back_to_rest();
  void use_standstill(const model::ImuSample& sample, double seconds);
  void use_corrections(model::Utime now);

  LidarImuInputParameters parameters_;
  LeverCompensation lever_;
  Levelling levelling_;
  StationaryMonitor stationary_;
  PoseTrack pose_;
  WheelSpeeds speeds_;
  VehicleConstraints constraints_;
  VelocityReference reference_;
  VelocityCorrections corrections_;
  MotionIncrements increments_;
  RestWatch rest_;
  std::deque<model::WheelSample> ahead_;  ///< Later than the IMU, in order of time.
};

}  // namespace understory::lidar_imu_input
