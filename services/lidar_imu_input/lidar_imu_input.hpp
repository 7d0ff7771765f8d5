// The input stage: raw sensors in, one consistent stream of motion and sweeps out.
//
// A piece of ODOMETRY ends exactly at the stamp of each published sweep or scan and is published
// before it; in between, pieces end at most `max_piece_s` apart. So a sweep waits until the IMU and
// the wheels have reached its end, but no longer than `max_wait_s` of the sensors' own time.
#pragma once

#include <deque>
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
#include "services/lidar_imu_input/filter_motion.hpp"
#include "services/lidar_imu_input/input_guard.hpp"
#include "services/lidar_imu_input/motion_estimator.hpp"

namespace understory::lidar_imu_input {

/// What the stage gives, in the order of publishing. Frames: vehicle, vehicle_level; see the types.
using InputResult =
    std::variant<model::ImuSample, model::WheelSample, model::GnssFix, model::Odometry,
                 model::RawPose, model::PointSweep, model::PlanarScan, InputFault>;
using InputResults = std::vector<InputResult>;

struct InputCounters {
  std::uint64_t sweeps = 0;
  std::uint64_t sweeps_not_deskewed = 0;
  std::uint64_t sweeps_by_filter = 0;  ///< De-skewed by the filter's motion.
  std::uint64_t sweeps_carried = 0;    ///< Came late: stamped with the end of the latest piece.
  std::uint64_t sweeps_dropped = 0;    ///< Too late even for that, or waiting at a restart.
  std::uint64_t points_dropped = 0;    ///< Not finite.
  std::uint64_t pieces_missing = 0;    ///< Intervals without any motion sensor.
  std::uint64_t corrections_late = 0;
  std::uint64_t samples_saturated = 0;

  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.sweeps, self.sweeps_not_deskewed, self.sweeps_by_filter, self.sweeps_carried,
      self.sweeps_dropped, self.points_dropped, self.pieces_missing, self.corrections_late,
      self.samples_saturated);
  }
};

class LidarImuInput {
 public:
  explicit LidarImuInput(const LidarImuInputParameters& parameters = {});

  InputResults add(const model::ImuSample& sample);    ///< RAW_IMU, frame sensor.
  InputResults add(const model::WheelSample& sample);  ///< RAW_WHEELS.
  InputResults add(const model::GnssFix& fix);         ///< RAW_GNSS.
  InputResults add(model::PointSweep sweep);           ///< RAW_SWEEP, a whole turn, frame sensor.
  InputResults add(const model::PlanarScan& scan);     ///< RAW_SCAN.
  InputResults add(const model::VelocityCorrection& correction);
  /// Where no sensor tells the motion, sweeps are de-skewed by the filter's.
  InputResults add(const model::EkfPose& pose);
  /// The drive is over: what still waits goes out.
  InputResults finish();

  /// Everything but the points of sweeps that wait: bulk is no state. load() throws
  /// std::invalid_argument for what save() did not give. Afterwards sensors may have been silent
  /// for the while that the service was away; after more than `kLongestPause_s` the stage starts
  /// anew.
  std::string save() const;
  void load(const std::string& state);
  static constexpr double kLongestPause_s = 600.0;

  const InputCounters& counters() const { return counters_; }
  const MotionEstimator& motion() const { return motion_; }
  bool is_calibrated() const { return motion_.is_calibrated(); }

 private:
  /// A sweep whose points were lost at a restart: its piece of odometry still ends there.
  struct LostSweep {};
  struct Waiting {
    model::Utime end = 0;
    std::variant<LostSweep, model::PointSweep, model::PlanarScan> item;
  };

  void wait(model::Utime end, std::variant<LostSweep, model::PointSweep, model::PlanarScan> item,
            InputResults& out);
  void settle(InputResults& out, bool everything);
  bool is_reached(model::Utime utime) const;
  void end_increment(model::Utime utime, InputResults& out);
  void release(Waiting waiting, InputResults& out);
  void release_sweep(model::PointSweep raw, model::Utime stamp, InputResults& out);
  void report(std::vector<InputFault>& faults, InputResults& out);
  void publish_raw_pose(bool at_once, InputResults& out);
  void check_calibration(InputResults& out);
  bool is_repeated(const model::PointSweep& sweep);
  void check_pause(Sensor sensor, model::Utime raw, InputResults& out);

  LidarImuInputParameters parameters_;
  InputGuard guard_;
  MotionEstimator motion_;
  FilterMotion filter_motion_;
  InputCounters counters_;
  std::deque<Waiting> waiting_;                ///< In order of their ends.
  std::optional<model::Utime> increment_end_;  ///< Of the latest piece.
  std::optional<model::Utime> sweep_stamp_;
  std::optional<model::Utime> scan_stamp_;
  std::optional<model::Utime> raw_pose_utime_;
  std::vector<model::SweepPoint> first_points_;  ///< Of the latest sweep, to notice a frozen laser.
  bool calibration_reported_ = false;
  std::optional<model::Utime> resumed_from_;  ///< After loading, until a sensor speaks.
  bool was_saturated_ = false;                ///< The latest sample of the IMU; it was left out.
};

}  // namespace understory::lidar_imu_input
