// The input stage: raw sensors in, one consistent stream of motion and sweeps out.
//
// An increment of ODOMETRY ends exactly at the stamp of each published sweep or scan and is
// published before it; in between, increments are at most `max_increment_s` long. So a sweep waits
// until the IMU and the wheels have reached its end, but at most `max_wait_s` of the sensors' own
// time. Before that, readings are sorted by their stamps, and readings with doubtful stamps are
// held back (`ArrivalOrder`, `TimeBase`).
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/model/ekf_output.hpp"
#include "common/model/gnss.hpp"
#include "common/model/imu.hpp"
#include "common/model/odometry.hpp"
#include "common/model/planar_scan.hpp"
#include "common/model/point_sweep.hpp"
#include "common/model/wheels.hpp"
#include "services/lidar_imu_input/arrival_order.hpp"
#include "services/lidar_imu_input/filter_motion.hpp"
#include "services/lidar_imu_input/gravity_check.hpp"
#include "services/lidar_imu_input/input_guard.hpp"
#include "services/lidar_imu_input/laser_check.hpp"
#include "services/lidar_imu_input/motion_agreement.hpp"
#include "services/lidar_imu_input/motion_estimator.hpp"
#include "services/lidar_imu_input/output_pacing.hpp"
#include "services/lidar_imu_input/raw_reading.hpp"
#include "services/lidar_imu_input/step_back.hpp"
#include "services/lidar_imu_input/sweep_queue.hpp"
#include "services/lidar_imu_input/time_base.hpp"

namespace understory::lidar_imu_input {

/// One output of the stage. Frames: vehicle, vehicle_level; see the types.
using InputResult = std::variant<model::ImuSample, model::WheelSample, model::GnssFix,
                                 model::Odometry, model::RestLevel, model::RawPose,
                                 model::PointSweep, model::PlanarScan, InputFault>;
/// In the order of publishing.
using InputResults = std::vector<InputResult>;

/// Counts of sweeps, increments and samples, since the start.
struct InputCounters {
  std::uint64_t sweeps = 0;               ///< Published.
  std::uint64_t sweeps_not_deskewed = 0;  ///< Published without any motion.
  std::uint64_t sweeps_by_filter = 0;     ///< De-skewed by the filter's motion.
  std::uint64_t sweeps_carried = 0;       ///< Late: stamped with the end of the latest increment.
  std::uint64_t sweeps_dropped = 0;       ///< Later than that permits, or waiting at a restart.
  std::uint64_t points_dropped = 0;       ///< Not finite.
  std::uint64_t increments_missing = 0;   ///< Intervals without any motion sensor.
  std::uint64_t corrections_late = 0;     ///< Applied after their delay.
  std::uint64_t samples_saturated = 0;    ///< Of the IMU: omitted.

  /// For saving and loading.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.sweeps, self.sweeps_not_deskewed, self.sweeps_by_filter, self.sweeps_carried,
      self.sweeps_dropped, self.points_dropped, self.increments_missing, self.corrections_late,
      self.samples_saturated);
  }
};

/// The stage. Each add() returns the results that can be published now; faults are results, never
/// exceptions. Invariant: stamps of each output advance, and increments of odometry follow each
/// other without gaps unless no sensor measured the motion.
class LidarImuInput {
 public:
  /// Starts with unknown motion. Precondition: parameters within the ranges of describe().
  explicit LidarImuInput(const LidarImuInputParameters& parameters = {});

  /// A reading of a sensor, frame sensor; a whole revolution of a 3-D laser.
  InputResults add(RawReading raw);
  InputResults add(const model::VelocityCorrection& correction);  ///< VELOCITY_CORRECTION.
  /// EKF_POSE: without a motion sensor, sweeps are de-skewed by the filter's motion.
  InputResults add(const model::EkfPose& pose);
  /// End of the drive: publishes everything that waits.
  InputResults finish();

  /// The state as bytes: everything except the points of waiting sweeps.
  std::string save() const;
  /// Continues from a saved state. Throws std::invalid_argument on other bytes, without change.
  void load(const std::string& state);
  /// After a longer pause of all sensors, or of the service, the vehicle's pose and its sensors'
  /// temperature are unknown: the stage restarts.
  static constexpr double kLongestPause_s = 600.0;

  /// Whether the sensor is not used for the motion, because its measurements are certainly wrong.
  bool leaves_out(Sensor sensor) const;
  /// The check of the IMU by gravity.
  const GravityCheck& gravity() const { return gravity_; }
  /// The check of IMU against wheels.
  const MotionAgreement& agreement() const { return agreement_; }
  /// The check of the laser by the ground.
  const LaserCheck& laser() const { return laser_; }
  /// Whether a sensor that must send is silent.
  bool is_silent(Sensor sensor) const { return guard_.is_silent(sensor); }
  const InputCounters& counters() const { return counters_; }  ///< Since the first start.
  /// Attitude, dead reckoning, calibration.
  const MotionEstimator& motion() const { return motion_; }

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.step_back_, self.time_base_, self.order_, self.guard_, self.gravity_, self.agreement_,
      self.laser_, self.motion_, self.filter_motion_, self.counters_, self.queue_,
      self.increment_end_, self.raw_poses_, self.calibration_, self.was_saturated_,
      self.left_out_imu_, self.left_out_wheels_);
  }

 private:
  void use(const model::ImuSample& raw, InputResults& out);
  void use(const model::WheelSample& raw, InputResults& out);
  void use(const model::GnssFix& raw, InputResults& out);
  void use(model::PointSweep sweep, InputResults& out);
  void use(const model::PlanarScan& raw, InputResults& out);
  void take(RawReading reading, InputResults& out);
  void begin_anew();
  void begin_motion_anew();
  void note_left_out();
  void wait(WaitingSweep waiting, InputResults& out);
  void use_ready(InputResults& out, bool everything);
  void settle(InputResults& out, bool everything);
  void end_increment(model::Utime utime, InputResults& out);
  void release(WaitingSweep waiting, InputResults& out);
  void release_scan(model::PlanarScan scan, model::Utime stamp, InputResults& out);
  void release_sweep(model::PointSweep raw, Sensor sensor, model::Utime stamp, InputResults& out);

  LidarImuInputParameters parameters_;
  StepBack step_back_;
  TimeBase time_base_;
  ArrivalOrder order_;
  InputGuard guard_;
  GravityCheck gravity_;
  MotionAgreement agreement_;
  LaserCheck laser_;
  MotionEstimator motion_;
  FilterMotion filter_motion_;
  InputCounters counters_;
  SweepQueue queue_;
  std::optional<model::Utime> increment_end_;  ///< Of the latest odometry.
  RawPosePacer raw_poses_;
  CalibrationWatch calibration_;
  bool was_saturated_ = false;  ///< The IMU's latest sample was saturated and omitted.
  bool left_out_imu_ = false;   ///< See leaves_out().
  bool left_out_wheels_ = false;
};

}  // namespace understory::lidar_imu_input
