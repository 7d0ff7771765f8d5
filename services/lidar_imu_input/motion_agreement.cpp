#include "services/lidar_imu_input/motion_agreement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "services/lidar_imu_input/stamps.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr double kAgreementDegree_rad = std::numbers::pi / 180.0;
/// Factors of the rates, for each tested gyro.
constexpr double kGyroFactors[] = {1.0, -1.0, kAgreementDegree_rad};

constexpr double kWindow_s = 0.5;
constexpr double kEnd_s = 0.1;
/// Time for which the gyro keeps the direction of gravity.
constexpr double kKeepsLevel_s = 30.0;
/// Least speed of a window.
constexpr double kMoves_mps = 0.3;

/// Errors of a window's means: bumps and the level; noise and zero of the steering; its scale.
constexpr double kForceSigma_mps2 = 0.1;
constexpr double kTurnSigma_rad_s = 0.02;
constexpr double kTurnSigma_share = 0.1;
/// Largest chi^2 of one number: slip and bumps must not decide.
constexpr double kMostChi2 = 16.0;
/// Least decrease of chi^2 by a fault relative to no fault,
constexpr double kIsWrong = 40.0;
/// and relative to each fault of the other sensor.
constexpr double kIsTheOne = 12.0;

constexpr double kYawStep_rad = 2.0 * kAgreementDegree_rad;
constexpr double kLeastYaw_rad = 4.0 * kAgreementDegree_rad;
constexpr double kHarmfulYaw_rad = 15.0 * kAgreementDegree_rad;
constexpr double kSpeedStep = 1.05;
constexpr double kLeastSpeedStep = 1.25;
constexpr double kMostSpeedStep = 4.2;

std::size_t gyro_of(OddOne odd) {
  return odd == OddOne::kGyroSign ? 1 : odd == OddOne::kGyroUnit ? 2 : 0;
}

/// All hypotheses, with the steering and without.
std::vector<MotionAccount> all_accounts() {
  std::vector<MotionAccount> accounts;
  const auto add = [&](OddOne odd, double value) {
    for (const bool steered : {true, false}) accounts.push_back({odd, value, steered});
  };

  add(OddOne::kNone, 0.0);
  for (double yaw = kLeastYaw_rad; yaw <= std::numbers::pi; yaw += kYawStep_rad) {
    add(OddOne::kImuYaw, yaw);
    add(OddOne::kImuYaw, -yaw);
  }
  add(OddOne::kGyroSign, -1.0);
  add(OddOne::kGyroUnit, kAgreementDegree_rad);

  add(OddOne::kWheelSpeed, -1.0);
  for (double factor = kLeastSpeedStep; factor <= kMostSpeedStep; factor *= kSpeedStep) {
    for (const double one : {factor, 1.0 / factor}) {
      add(OddOne::kWheelSpeed, one);
      add(OddOne::kWheelSpeed, -one);
    }
  }
  accounts.push_back({OddOne::kSteering, -1.0, true});
  return accounts;
}

double capped(double residual) { return std::min(residual * residual, kMostChi2); }

}  // namespace

MotionAgreement::MotionAgreement(const LidarImuInputParameters& parameters)
    : mount_(parameters.imu.mount),
      car_(parameters.wheels.car),
      rest_speed_mps_(parameters.standstill.wheel_speed_mps),
      accounts_(all_accounts()),
      chi2_(accounts_.size(), 0.0) {
  turned_.fill(Eigen::Quaterniond::Identity());
}

void MotionAgreement::add(const model::WheelSample& raw) {
  if (seconds_between(raw.utime, window_.from) > kEnd_s)
    return;  // Late: belongs to another window.
  const double speed = axle_speed(car_, raw.speed_mps, raw.steering_rad);
  latest_wheels_utime_ = raw.utime;
  window_.speed += speed;
  window_.steered += speed * std::tan(raw.steering_rad) / car_.wheelbase_m;
  window_.fastest = std::max(window_.fastest, std::abs(speed));
  window_.samples += 1.0;
  if (seconds_between(window_.from, raw.utime) < kWindow_s - kEnd_s) return;
  window_.last_speed += speed;
  window_.last_samples += 1.0;
}

void MotionAgreement::add(const model::ImuSample& raw) {
  const double seconds = latest_imu_ ? seconds_between(latest_imu_->utime, raw.utime) : 0.0;
  latest_imu_ = raw;
  if (seconds <= 0.0 || seconds > kEnd_s) {
    // The motion in between is unknown.
    rested_utime_.reset();
    rest_windows_ = 0.0;
    speed_before_.reset();
    window_ = Window{.from = raw.utime};
    return;
  }

  window_.seconds += seconds;
  window_.force += seconds * raw.specific_force_mps2;
  window_.rate += seconds * raw.angular_rate_rad_s;
  for (std::size_t i = 0; i < kGyros && rested_utime_; ++i) {
    const Eigen::Vector3d rate = kGyroFactors[i] * (raw.angular_rate_rad_s - rest_rate_);
    const double angle = rate.norm() * seconds;
    if (angle > 0.0)
      turned_[i] = (turned_[i] * Eigen::AngleAxisd(angle, rate.normalized())).normalized();
    const Eigen::Vector3d gravity = turned_[i].conjugate() * rest_force_;
    window_.free_force[i] += seconds * (raw.specific_force_mps2 - gravity);
    window_.turn[i] += seconds * rate.dot(gravity.normalized());
  }
  if (window_.seconds >= kWindow_s) end_window(raw.utime);
}

void MotionAgreement::end_window(model::Utime utime) {
  const bool has_wheels = window_.samples > 0.0 && window_.last_samples > 0.0;
  if (has_wheels && window_.fastest <= rest_speed_mps_) {
    rest();
    rested_utime_ = utime;
  } else {
    rest_windows_ = 0.0;
    const bool is_level = rested_utime_ && seconds_between(*rested_utime_, utime) < kKeepsLevel_s;
    if (has_wheels && is_level && speed_before_) {
      const Measured now = measured();
      if (window_.fastest > kMoves_mps) compare(now);
      turn_before_ = now.turn_rad_s;
    }
  }

  speed_before_.reset();
  if (has_wheels) speed_before_ = window_.last_speed / window_.last_samples;
  window_ = Window{.from = utime};
}

void MotionAgreement::rest() {
  rest_windows_ += 1.0;
  rest_force_ = window_.force / window_.seconds;
  const Eigen::Vector3d rate = window_.rate / window_.seconds;
  rest_rate_ = rest_windows_ > 1.0
                   ? Eigen::Vector3d(rest_rate_ + (rate - rest_rate_) / rest_windows_)
                   : rate;
  turned_.fill(Eigen::Quaterniond::Identity());
  turn_before_.fill(0.0);
}

MotionAgreement::Measured MotionAgreement::measured() const {
  Measured result;
  for (std::size_t i = 0; i < kGyros; ++i) {
    const Eigen::Vector3d force = mount_.rotation() * window_.free_force[i] / window_.seconds;
    result.force_mps2[i] = force.head<2>();
    result.turn_rad_s[i] = window_.turn[i] / window_.seconds;
    result.turning_rad_s2[i] = (result.turn_rad_s[i] - turn_before_[i]) / window_.seconds;
  }
  result.speed_mps = window_.speed / window_.samples;
  result.steered_rad_s = window_.steered / window_.samples;
  result.acceleration_mps2 =
      (window_.last_speed / window_.last_samples - speed_before_.value_or(0.0)) / window_.seconds;
  return result;
}

double MotionAgreement::misfit(const MotionAccount& account, const Measured& measured) const {
  const std::size_t gyro = gyro_of(account.odd);
  const double by_wheels = account.odd == OddOne::kWheelSpeed ? 1.0 / account.value : 1.0;
  const double side = account.odd == OddOne::kSteering ? -1.0 : 1.0;
  const double speed = by_wheels * measured.speed_mps;
  const double steered = side * by_wheels * measured.steered_rad_s;
  const double turn = account.steered ? steered : measured.turn_rad_s[gyro];

  // An IMU away from the vehicle's origin measures its own centripetal force.
  const double turning = measured.turning_rad_s2[gyro];
  Eigen::Vector2d force(by_wheels * measured.acceleration_mps2, speed * turn);
  force += turning * Eigen::Vector2d(-mount_.y_m, mount_.x_m) -
           turn * turn * Eigen::Vector2d(mount_.x_m, mount_.y_m);
  if (account.odd == OddOne::kImuYaw) force = Eigen::Rotation2Dd(-account.value) * force;

  const Eigen::Vector2d off = (measured.force_mps2[gyro] - force) / kForceSigma_mps2;
  double chi2 = capped(off.x()) + capped(off.y());
  if (account.steered)
    chi2 += capped((measured.turn_rad_s[gyro] - steered) /
                   (kTurnSigma_rad_s + kTurnSigma_share * std::abs(steered)));
  return chi2;
}

void MotionAgreement::compare(const Measured& measured) {
  for (std::size_t i = 0; i < accounts_.size(); ++i) chi2_[i] += misfit(accounts_[i], measured);
  judge();
}

MotionAgreement::Best MotionAgreement::best(bool steered) const {
  std::optional<std::size_t> none;
  std::optional<std::size_t> imu;
  std::optional<std::size_t> wheels;
  for (std::size_t i = 0; i < accounts_.size(); ++i) {
    if (accounts_[i].steered != steered) continue;
    const OddOne odd = accounts_[i].odd;
    std::optional<std::size_t>& one = odd == OddOne::kNone ? none : is_of_imu(odd) ? imu : wheels;
    if (!one || chi2_[i] < chi2_[*one]) one = i;
  }
  return {*none, *imu, *wheels};
}

void MotionAgreement::judge() {
  verdict_ = {};
  const Best with = best(true);
  const bool is_imu = chi2_[with.imu] < chi2_[with.wheels];
  const std::size_t one = is_imu ? with.imu : with.wheels;
  const std::size_t other = is_imu ? with.wheels : with.imu;
  if (chi2_[one] + kIsWrong > chi2_[with.none] || chi2_[one] + kIsTheOne > chi2_[other]) return;

  // A vehicle may measure no steering: the fault must be significant without it, too.
  if (accounts_[one].odd != OddOne::kSteering) {
    const Best without = best(false);
    const std::size_t same = is_imu ? without.imu : without.wheels;
    if (chi2_[same] + kIsWrong > chi2_[without.none]) return;
  }
  verdict_ = accounts_[one];
}

bool MotionAgreement::is_useless() const {
  if (verdict_.odd == OddOne::kImuYaw) return std::abs(verdict_.value) > kHarmfulYaw_rad;
  return verdict_.odd != OddOne::kNone && verdict_.odd != OddOne::kSteering;
}

std::string MotionAgreement::text() const {
  switch (verdict_.odd) {
    case OddOne::kImuYaw:
      return fmt::format(
          "it feels the vehicle's acceleration {:.0f} deg beside where the wheels speed up: "
          "imu.mount yaw_rad = {:.2f} would agree",
          std::abs(verdict_.value) / kAgreementDegree_rad,
          std::remainder(mount_.yaw_rad + verdict_.value, 2.0 * std::numbers::pi));
    case OddOne::kGyroSign:
      return "its rates are turned round: wheels and acceleration turn the other way";
    case OddOne::kGyroUnit:
      return "its rates are 57.3 times those of wheels and acceleration: its driver must send "
             "rad/s, not deg/s";
    case OddOne::kWheelSpeed:
      return fmt::format("their speed is {:.2f} times that which the IMU feels{}", verdict_.value,
                         verdict_.value < 0.0 ? ": its sign is turned round" : ": unit or ticks");
    case OddOne::kSteering:
      return "they steer to the other side than gyro and acceleration: left and right are swapped";
    case OddOne::kNone:
      break;
  }
  return "";
}

}  // namespace understory::lidar_imu_input
