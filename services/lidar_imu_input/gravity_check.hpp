// Checks the gravity measured by an IMU at rest: unit, sign and mounting.
#pragma once

#include <deque>
#include <string>

#include "common/model/imu.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

/// Result of the check.
enum class GravityVerdict : std::uint8_t {
  kUnknown,     ///< It was not quiet yet.
  kRight,       ///< 9.81 m/s^2, upwards in frame vehicle.
  kInG,         ///< Magnitude 1: the unit is g. Certain, and converted.
  kPointsDown,  ///< The IMU is upside down, or the sign is reversed.
  kTilted,      ///< Far from upwards: the mounting differs from the configuration.
  kMissing,     ///< Gravity was subtracted before.
  kWrongScale,  ///< Another magnitude.
};

/// Examines half a second of samples at a time. A quiet vehicle need not be stationary: it is not
/// accelerated, so the accelerometer measures only gravity.
class GravityCheck {
 public:
  /// `mount`: of the IMU; `quiet`: limits as for a standstill.
  GravityCheck(const SensorMount& mount, const StandstillParameters& quiet)
      : mount_(mount), quiet_(quiet) {}

  /// Adds a raw sample in frame sensor. True if it proves that the unit is g: results from earlier
  /// samples are then wrong.
  bool add(const model::ImuSample& raw);
  /// Factor that converts a sample's force to m/s^2.
  double scale() const { return scale_; }
  /// Of the latest quiet samples.
  GravityVerdict verdict() const { return verdict_; }
  /// Whether its samples give no level of the vehicle.
  bool is_useless() const {
    return verdict_ != GravityVerdict::kUnknown && verdict_ != GravityVerdict::kRight &&
           verdict_ != GravityVerdict::kInG;
  }
  /// Their mean force, frame sensor.
  const Eigen::Vector3d& mean_mps2() const { return mean_mps2_; }
  /// For a person: the fault, and the setting that corrects it; empty without a fault.
  std::string text() const;

  /// Members of a saved state; see common/state. The rest is configuration.
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
