// The input stage: raw sensors in, one consistent stream of motion and sweeps out.
//
// An increment of ODOMETRY ends exactly at the stamp of each published sweep or scan and is
// published before it; in between, increments end at most `max_increment_s` apart. So a sweep waits
// until the IMU and the wheels have reached its end, but no longer than `max_wait_s` of the
// sensors' own time. Before any of this readings are put in the order of their stamps, and those
// are held back whose stamps nothing supports (`ArrivalOrder`, `TimeBase`).
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

/// What became of sweeps, increments and samples, since the start.
struct InputCounters {
  std::uint64_t sweeps = 0;               ///< Published.
  std::uint64_t sweeps_not_deskewed = 0;  ///< Published without any motion.
  std::uint64_t sweeps_by_filter = 0;     ///< De-skewed by the filter's motion.
  std::uint64_t sweeps_carried = 0;       ///< Late: stamped with the end of the latest increment.
  std::uint64_t sweeps_dropped = 0;       ///< Too late even for that, or waiting at a restart.
  std::uint64_t points_dropped = 0;       ///< Not finite.
  std::uint64_t increments_missing = 0;   ///< Intervals without any motion sensor.
  std::uint64_t corrections_late = 0;     ///< Took effect later than their delay.
  std::uint64_t samples_saturated = 0;    ///< Of the IMU: left out.

  /// For saving and loading.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.sweeps, self.sweeps_not_deskewed, self.sweeps_by_filter, self.sweeps_carried,
      self.sweeps_dropped, self.points_dropped, self.increments_missing, self.corrections_late,
      self.samples_saturated);
  }
};

/// The stage. Each add() gives what can be published now; no message is refused by an exception,
/// faults are results. Invariant: stamps of each output advance, and increments of odometry join
/// without gaps but where no sensor measured motion.
class LidarImuInput {
 public:
  /// Starts without any motion known. Precondition: parameters within the ranges of describe().
  explicit LidarImuInput(const LidarImuInputParameters& parameters = {});

  /// A reading of a sensor, frame sensor; of a laser that scans in space a whole revolution.
  InputResults add(RawReading raw);
  InputResults add(const model::VelocityCorrection& correction);  ///< VELOCITY_CORRECTION.
  /// EKF_POSE: where no sensor measures the motion, sweeps are de-skewed by the filter's.
  InputResults add(const model::EkfPose& pose);
  /// The drive is over: what still waits goes out.
  InputResults finish();

  /// The state as bytes: everything but the points of sweeps that wait.
  std::string save() const;
  /// Goes on from a saved state. Throws std::invalid_argument for what save() did not give, and
  /// stays as it was.
  void load(const std::string& state);
  /// After a longer pause of all sensors, or of the service, the vehicle may be anywhere, and its
  /// sensors at any temperature: the stage starts anew.
  static constexpr double kLongestPause_s = 600.0;

  /// Whether the sensor is left out of the motion, as what it measures is certainly wrong.
  bool leaves_out(Sensor sensor) const;
  /// What the IMU shows of gravity.
  const GravityCheck& gravity() const { return gravity_; }
  /// Whether IMU and wheels measure one motion.
  const MotionAgreement& agreement() const { return agreement_; }
  /// Whether the laser sees the ground where it must.
  const LaserCheck& laser() const { return laser_; }
  /// Whether a sensor that must send does not.
  bool is_silent(Sensor sensor) const { return guard_.is_silent(sensor); }
  const InputCounters& counters() const { return counters_; }  ///< Since the first start.
  /// Attitude, dead reckoning, calibration.
  const MotionEstimator& motion() const { return motion_; }

  /// For saving and loading: what changes while it runs.
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
  bool was_saturated_ = false;  ///< The latest sample of the IMU; it was left out.
  bool left_out_imu_ = false;   ///< See leaves_out().
  bool left_out_wheels_ = false;
};

}  // namespace understory::lidar_imu_input
