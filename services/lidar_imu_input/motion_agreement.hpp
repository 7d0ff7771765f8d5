// Checks whether gyro, accelerometer, wheel speed and steering measure one motion, and finds the
// faulty one.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "common/model/imu.hpp"
#include "common/model/wheels.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

/// Possible fault of IMU or wheels, one at a time.
enum class OddOne : std::uint8_t {
  kNone,        ///< All agree.
  kImuYaw,      ///< The IMU is mounted at another yaw.
  kGyroSign,    ///< Rates have the wrong sign.
  kGyroUnit,    ///< Rates are in degrees per second.
  kWheelSpeed,  ///< The speed is too large, too small, or has the wrong sign.
  kSteering,    ///< Left and right are swapped.
};

/// One hypothesis: a fault and its size.
struct MotionAccount {
  OddOne odd = OddOne::kNone;
  double value = 0.0;   ///< Yaw to be added [rad], or factor of the speed.
  bool steered = true;  ///< False: the steering angle is ignored, all rotations are from the gyro.
};

/// Over half a second each, compares the accelerometer without gravity with the change of the
/// wheels' speed and with the centripetal force, and the gyro's rotation with that by steering.
/// With three sources the one that disagrees is faulty: each hypothesis with one fault is tested,
/// and accepted if it fits all windows far better than no fault does, and than a fault of another
/// sensor. Gravity is that of the last standstill, rotated by the gyro; so there is no result
/// before the first standstill, nor later than half a minute after one. Independent of all other
/// estimates. Cost: three rotations per sample, about 560 hypotheses per half second.
class MotionAgreement {
 public:
  /// `parameters`: mounting of the IMU and geometry of the car.
  explicit MotionAgreement(const LidarImuInputParameters& parameters);

  /// A sample in frame sensor, its force in m/s^2; stamps advance.
  void add(const model::ImuSample& raw);
  /// A raw sample of the wheels.
  void add(const model::WheelSample& raw);

  /// The fault, by all windows so far.
  OddOne odd() const { return verdict_.odd; }
  /// Its size: see MotionAccount.
  double value() const { return verdict_.value; }
  /// True for faults of the IMU, false for the wheels.
  static bool is_of_imu(OddOne odd) {
    return odd == OddOne::kImuYaw || odd == OddOne::kGyroSign || odd == OddOne::kGyroUnit;
  }
  /// Whether the motion is estimated better without the faulty sensor. A yaw error of the IMU of
  /// some degrees, or the steering beside a gyro, does little harm.
  bool is_useless() const;
  /// For a person, with the setting that corrects it; empty without a fault.
  std::string text() const;

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.chi2_, self.verdict_.odd, self.verdict_.value, self.rest_force_, self.rest_rate_,
      self.rest_windows_, self.rested_utime_, self.turned_, self.window_, self.speed_before_,
      self.turn_before_, self.latest_imu_, self.latest_wheels_utime_);
  }

 private:
  static constexpr std::size_t kGyros = 3;  ///< Unchanged, sign reversed, in degrees.

  /// Sums over half a second.
  struct Window {
    model::Utime from = 0;
    double seconds = 0.0;
    Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< Times seconds, frame sensor.
    Eigen::Vector3d rate = Eigen::Vector3d::Zero();
    std::array<Eigen::Vector3d, kGyros> free_force{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                                   Eigen::Vector3d::Zero()};
    std::array<double, kGyros> turn{};
    double speed = 0.0;  ///< Sums over samples of the wheels.
    double steered = 0.0;
    double fastest = 0.0;
    double samples = 0.0;
    double last_speed = 0.0;  ///< Of the last 0.1 s.
    double last_samples = 0.0;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& self) {
      a(self.from, self.seconds, self.force, self.rate, self.free_force, self.turn, self.speed,
        self.steered, self.fastest, self.samples, self.last_speed, self.last_samples);
    }
  };
  /// Measurements of a window.
  struct Measured {
    std::array<Eigen::Vector2d, kGyros> force_mps2;  ///< Without gravity, frame vehicle.
    std::array<double, kGyros> turn_rad_s{};
    std::array<double, kGyros> turning_rad_s2{};  ///< Change of the rate.
    double speed_mps = 0.0;
    double acceleration_mps2 = 0.0;
    double steered_rad_s = 0.0;  ///< By speed and steering.
  };

  void end_window(model::Utime utime);
  void rest();
  void compare(const Measured& measured);
  double misfit(const MotionAccount& account, const Measured& measured) const;
  void judge();
  /// The best hypothesis of each sensor, and that of no fault: indices in accounts_.
  struct Best {
    std::size_t none = 0;
    std::size_t imu = 0;
    std::size_t wheels = 0;
  };
  Best best(bool steered) const;
  Measured measured() const;

  SensorMount mount_;
  CarGeometry car_;
  double rest_speed_mps_;
  std::vector<MotionAccount> accounts_;  ///< chi2_ has their chi^2.
  std::vector<double> chi2_;
  MotionAccount verdict_;

  Eigen::Vector3d rest_force_ = Eigen::Vector3d::Zero();  ///< At the last standstill.
  Eigen::Vector3d rest_rate_ = Eigen::Vector3d::Zero();
  double rest_windows_ = 0.0;  ///< Number in the present standstill; 0 = moving.
  std::optional<model::Utime> rested_utime_;
  std::array<Eigen::Quaterniond, kGyros> turned_;  ///< Rotation since then, by each gyro.
  Window window_;
  std::optional<double> speed_before_;  ///< At the end of the previous window.
  std::array<double, kGyros> turn_before_{};
  std::optional<model::ImuSample> latest_imu_;
  model::Utime latest_wheels_utime_ = 0;
};

}  // namespace understory::lidar_imu_input
