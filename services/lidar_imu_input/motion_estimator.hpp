// Everything that is known about the vehicle's motion without a landmark, and the dead reckoning
// that the filter may correct.
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

/// Leads each sample of IMU, wheels and GNSS through attitude, standstill, dead reckoning and the
/// samples of which ODOMETRY is made. Values are finite and stamps per sensor advance: `InputGuard`
/// sees to that. Cost: some microseconds per sample.
class MotionEstimator {
 public:
  /// Starts without any motion known.
  explicit MotionEstimator(const LidarImuInputParameters& parameters);

  /// The sample in frame vehicle, as if measured at its origin; stamps must advance.
  model::ImuSample to_vehicle(const model::ImuSample& sensor_sample);
  /// Takes a sample that to_vehicle() gave. `is_saturated`: the samples before it were left out
  /// since a sensor was at the end of its range.
  void add_imu(const model::ImuSample& vehicle_sample, bool is_saturated);
  /// Takes speed and steering. Attitude and velocity are those of the latest IMU sample: a sample
  /// that is later than that by more than `imu.max_gap_s` corrects them when the IMU gets there.
  void add_wheels(const model::WheelSample& sample);
  /// Takes a fix: ignored unless `gnss_aided`.
  void add_gnss(const model::GnssFix& fix);
  /// False: it came too late to take effect in time; it does so at the next sample.
  bool add_correction(const model::VelocityCorrection& correction);

  /// Where the first interval of odometry starts.
  void begin(model::Utime utime) { increments_.begin(utime); }
  /// Motion between two stamps up to which samples have come; intervals in order. None where
  /// samples are missing.
  std::optional<model::Odometry> increment(model::Utime from, model::Utime to);

  /// News of the level at the last rest, after an increment up to `utime`.
  std::optional<model::RestLevel> rest_news(model::Utime utime);

  /// Motion during the last seconds.
  const MotionHistory& history() const { return pose_.history(); }
  /// Pose of the dead reckoning in `odom` with its covariance.
  model::RawPose raw_pose() const { return pose_.raw_pose(parameters_.gnss_aided); }
  /// Whether the vehicle stands still at the latest IMU sample.
  bool is_stationary() const { return stationary_.is_stationary(); }
  /// Whether the vehicle was stationary long enough for the gyro's bias to be known.
  bool is_calibrated() const { return stationary_.is_calibrated(); }
  /// None before the first IMU sample.
  const std::optional<AttitudeFilter>& attitude() const { return levelling_.attitude(); }
  /// Whether a loaded state is consistent: with an attitude come the samples it was propagated to.
  bool is_whole() const;

  /// For saving and loading: what changes while it runs.
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
