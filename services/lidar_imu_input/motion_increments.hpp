// ODOMETRY: relative motion between two stamps, from IMU and wheels, free of landmarks.
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

/// What an increment needs beside the samples that `MotionIncrements` keeps.
struct IncrementSources {
  AttitudeFilter* attitude = nullptr;  ///< Gets a mark at the increment's end; null = none yet.
  const WheelSpeeds& speeds;
  const MotionHistory& history;
  const StationaryMonitor& stationary;
};

/// Keeps the samples since the last increment and makes the next one of them. Invariant: increments
/// are numbered without gaps.
class MotionIncrements {
 public:
  /// Noise of IMU and wheels, and where the axle is.
  explicit MotionIncrements(const LidarImuInputParameters& parameters);

  /// Takes a levelled IMU sample. Precondition: stamps advance.
  void add(const LevelSample& sample) { levels_.add(sample); }
  /// Takes a wheel sample; one that does not come after its predecessor is ignored.
  void add(const model::WheelSample& sample) { wheel_only_.add(sample); }
  /// The first interval starts at `utime`.
  void begin(model::Utime utime) { wheel_only_.advance_to(utime); }

  /// Motion between two stamps up to which samples have come. Intervals are asked for in order.
  /// With `inertial` where the IMU covers the interval, else by the wheels alone; none where
  /// samples of both are missing.
  std::optional<model::Odometry> make(model::Utime from, model::Utime to,
                                      const IncrementSources& sources);

  /// For saving and loading: what changes while it runs.
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
