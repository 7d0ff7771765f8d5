// Everything that is known about the vehicle's motion without looking at a landmark, and the dead
// reckoning that the filter may correct.
#pragma once

#include <deque>
#include <optional>
#include <type_traits>
#include <vector>

#include "common/model/ekf_output.hpp"
#include "common/model/gnss.hpp"
#include "common/model/imu.hpp"
#include "common/model/odometry.hpp"
#include "services/lidar_imu_input/attitude_filter.hpp"
#include "services/lidar_imu_input/dead_reckoning.hpp"
#include "services/lidar_imu_input/level_motion.hpp"
#include "services/lidar_imu_input/motion_history.hpp"
#include "services/lidar_imu_input/standstill.hpp"
#include "services/lidar_imu_input/velocity_reference.hpp"
#include "services/lidar_imu_input/wheel_odometry.hpp"

namespace understory::lidar_imu_input {

class MotionEstimator {
 public:
  explicit MotionEstimator(const LidarImuInputParameters& parameters);

  /// The sample in frame vehicle, as if measured at its origin; stamps must advance.
  model::ImuSample to_vehicle(const model::ImuSample& sensor_sample);
  void add_imu(const model::ImuSample& vehicle_sample, bool is_saturated);
  void add_wheels(const model::WheelSample& sample);
  void add_gnss(const model::GnssFix& fix);
  /// False: it came too late to take effect in time; it does so at the next sample.
  bool add_correction(const model::VelocityCorrection& correction);

  /// Where the first interval starts.
  void begin(model::Utime utime);
  /// Motion between two stamps up to which samples have come; intervals in order. None where
  /// samples are missing.
  std::optional<model::Odometry> increment(model::Utime from, model::Utime to);

  const MotionHistory& history() const { return history_; }
  model::RawPose raw_pose() const;
  std::optional<model::Utime> pose_utime() const { return pose_utime_; }
  bool is_stationary() const { return standstill_.is_stationary(); }
  bool is_calibrated() const { return standstill_.is_calibrated(); }
  bool has_attitude() const { return attitude_.has_value(); }
  const std::optional<AttitudeFilter>& attitude() const { return attitude_; }
  /// With an attitude come the samples that it stands at.
  bool is_whole() const {
    return !attitude_ || (latest_ && latest_level_ && !raw_.empty() && !history_.empty());
  }

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    bool has_attitude = self.attitude_.has_value();
    a(has_attitude);
    if constexpr (!std::is_const_v<Self>) {
      self.attitude_.reset();
      const Eigen::Vector3d any_force(0.0, 0.0, kGravity_mps2);
      if (has_attitude) self.attitude_.emplace(self.parameters_.imu, any_force);
    }
    if (has_attitude) a(*self.attitude_);
    a(self.reckoning_, self.standstill_, self.wheel_only_, self.reference_, self.levels_,
      self.speeds_, self.history_, self.corrections_, self.raw_, self.latest_, self.latest_level_,
      self.pose_utime_, self.height_m_, self.stationary_bias_, self.stationary_bias_sigma_,
      self.moved_utime_, self.constrained_utime_, self.bounded_utime_, self.corrected_utime_,
      self.denied_since_, self.sequence_);
  }

 private:
  void start(const model::ImuSample& sample);
  void propagate(const model::ImuSample& sample, bool is_saturated, double seconds);
  void use_standstill(const model::ImuSample& sample, double seconds);
  void use_constraints(const model::ImuSample& sample);
  void use_correction(model::Utime now);
  void bridge_gap(const model::ImuSample& sample);
  LevelSample level(const model::ImuSample& sample, bool is_saturated) const;
  void remember(const model::ImuSample& sample);
  std::optional<model::Odometry> inertial_increment(model::Utime from, model::Utime to);
  std::optional<model::Odometry> wheel_increment(model::Utime from, model::Utime to);
  geometry::SE2WithCovariance dead_reckoned(const std::deque<LevelSample>& samples,
                                            const model::Preintegration& inertial) const;
  YawRateBias yaw_rate_bias() const { return {stationary_bias_, stationary_bias_sigma_}; }
  bool wheels_are_fresh(model::Utime now) const;
  bool velocity_allows_stationary(model::Utime now);
  double axle_speed_now(const model::WheelSample& sample) const;

  LidarImuInputParameters parameters_;
  Eigen::Vector3d axle_position_m_;  ///< In frame vehicle.
  Eigen::Vector3d axle_forward_;
  Eigen::Vector3d axle_left_;

  std::optional<AttitudeFilter> attitude_;
  DeadReckoning reckoning_;
  StandstillDetector standstill_;
  WheelOdometry wheel_only_;
  VelocityReference reference_;
  LevelSamples levels_;
  std::deque<SpeedSample> speeds_;
  MotionHistory history_;
  std::deque<model::VelocityCorrection> corrections_;

  std::deque<model::ImuSample> raw_;        ///< Latest, frame vehicle, lever not taken out.
  std::optional<model::ImuSample> latest_;  ///< Latest, frame vehicle.
  std::optional<LevelSample> latest_level_;
  std::optional<model::Utime> pose_utime_;  ///< What the dead reckoning stands at.
  double height_m_ = 0.0;
  double stationary_bias_ = 0.0;  ///< Of the yaw rate, from standing still only.
  double stationary_bias_sigma_ = 0.0;
  model::Utime moved_utime_ = 0;  ///< When the vehicle was last found not to stand.
  model::Utime constrained_utime_ = 0;
  model::Utime bounded_utime_ = 0;
  model::Utime corrected_utime_ = 0;               ///< When a correction last took effect.
  std::optional<model::Utime> denied_since_ = {};  ///< Since when the velocity has denied standing.
  std::uint64_t sequence_ = 0;
};

}  // namespace understory::lidar_imu_input
