// ODOMETRY: relative motion between two stamps, from IMU and wheels, without landmarks.
#pragma once

#include <optional>

#include "common/model/odometry.hpp"
#include "services/lidar_imu_input/attitude_filter.hpp"
#include "services/lidar_imu_input/level_motion.hpp"
#include "services/lidar_imu_input/motion_history.hpp"
#include "services/lidar_imu_input/stationary_monitor.hpp"
#include "services/lidar_imu_input/wheel_odometry.hpp"
#include "services/lidar_imu_input/wheel_speeds.hpp"

namespace understory::lidar_imu_input {

/// Inputs of an increment beside the samples in `MotionIncrements`.
struct IncrementSources {
  AttitudeFilter* attitude = nullptr;  ///< Marked at the increment's end; null = none yet.
  const WheelSpeeds& speeds;
  const MotionHistory& history;
  const StationaryMonitor& stationary;
};

/// Stores the samples since the last increment and makes the next one from them. Invariant:
/// increments are numbered without gaps.
class MotionIncrements {
 public:
  /// `parameters`: noise of IMU and wheels, and position of the axle.
  explicit MotionIncrements(const LidarImuInputParameters& parameters);

  /// Adds a levelled IMU sample. Precondition: stamps advance.
  void add(const LevelSample& sample) { levels_.add(sample); }
  /// Adds a wheel sample; one not later than its predecessor is ignored.
  void add(const model::WheelSample& sample) { wheel_only_.add(sample); }
  /// The first interval starts at `utime`.
  void begin(model::Utime utime) { wheel_only_.advance_to(utime); }

  /// Motion between two stamps that samples have reached; intervals in order. With `inertial` if
  /// the IMU covers the interval, else by the wheels alone; none if neither covers it.
  std::optional<model::Odometry> make(model::Utime from, model::Utime to,
                                      const IncrementSources& sources);

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.levels_, self.wheel_only_, self.sequence_);
  }

 private:
  std::optional<model::Odometry> by_imu(model::Utime from, model::Utime to,
                                        const IncrementSources& sources);
  std::optional<model::Odometry> by_wheels(model::Utime from, model::Utime to);
  geometry::SE2WithCovariance planar_motion(const std::deque<LevelSample>& samples,
                                            const IncrementSources& sources,
                                            model::Odometry& odometry) const;
  geometry::SE2WithCovariance dead_reckoned(const std::deque<LevelSample>& samples,
                                            const model::Preintegration& inertial,
                                            const IncrementSources& sources) const;

  LidarImuInputParameters parameters_;
  LevelSamples levels_;
  WheelOdometry wheel_only_;
  std::uint64_t sequence_ = 0;
};

}  // namespace understory::lidar_imu_input
