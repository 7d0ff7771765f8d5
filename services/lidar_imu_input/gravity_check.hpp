// Whether an IMU at rest measures gravity as it must: unit, sign and mounting.
#pragma once

#include <deque>
#include <string>

#include "common/model/imu.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

/// What a quiet IMU shows of gravity.
enum class GravityVerdict : std::uint8_t {
  kUnknown,     ///< It was not quiet yet.
  kRight,       ///< 9.81 m/s^2, upwards in frame vehicle.
  kInG,         ///< 1: the unit is g. Certain, and taken.
  kPointsDown,  ///< The IMU is upside down, or the sign is turned round.
  kTilted,      ///< Far from upwards: the mounting is not as configured.
  kMissing,     ///< Gravity was taken out before.
  kWrongScale,  ///< Another magnitude.
};

/// Looks at half a second of samples at a time. A quiet vehicle need not be stationary: it is not
/// accelerated, and gravity is all that the accelerometer feels.
class GravityCheck {
 public:
  /// `mount`: of the IMU; what is quiet: as for a standstill.
  GravityCheck(const SensorMount& mount, const StandstillParameters& quiet)
      : mount_(mount), quiet_(quiet) {}

  /// Takes a sample in frame sensor as it came. True where this one shows that the unit is g: what
  /// was made of the samples before is wrong.
  bool add(const model::ImuSample& raw);
  /// Takes the force of a sample to m/s^2.
  double scale() const { return scale_; }
  /// Of the latest quiet samples.
  GravityVerdict verdict() const { return verdict_; }
  /// Whether what it measures is no level of the vehicle.
  bool is_useless() const {
    return verdict_ != GravityVerdict::kUnknown && verdict_ != GravityVerdict::kRight &&
           verdict_ != GravityVerdict::kInG;
  }
  /// Their mean force, frame sensor.
  const Eigen::Vector3d& mean_mps2() const { return mean_mps2_; }
  /// For a person: what is wrong, and the setting that mends it; empty where nothing is.
  std::string text() const;

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.window_, self.scale_, self.verdict_, self.mean_mps2_);
  }

 private:
  bool is_quiet() const;
  GravityVerdict judge() const;

  SensorMount mount_;
  StandstillParameters quiet_;
  std::deque<model::ImuSample> window_;
  double scale_ = 1.0;
  GravityVerdict verdict_ = GravityVerdict::kUnknown;
  Eigen::Vector3d mean_mps2_ = Eigen::Vector3d::Zero();  ///< Of the latest quiet samples.
};

}  // namespace understory::lidar_imu_input
