#include "services/keyframer/joint/calibration_watch.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace understory::keyframer::joint {
namespace {

/// Prior sigmas, in the order of the numbers.
const CalibrationNumbers kPrior_sigma =
    (CalibrationNumbers() << 0.2, 1.0, 1.0, 0.2, 0.5, 0.01).finished();
/// Error of the rotation of a step that is missing in its covariances [rad]: levelling, the bias's
/// walk.
constexpr double kStepModel_rad = 5e-4;
/// Residual of a rotation [sigma] beyond which its weight decreases: a wrong pair must not decide.
constexpr double kRobustTurn = 2.5;
/// Largest chi^2 of the rotation of a step, for the same reason.
constexpr double kMostTurnChi2 = 25.0;
/// Weight of the stated noise against the measured rotations.
constexpr double kStatedTurns = 50.0;
/// Weight of "no bias" [s].
constexpr double kNoBias_s = 2.0;
/// chi^2 of 2 degrees of freedom beyond which two translations contradict each other: by chance
/// once in 10^7. Errors outside both covariances make it far more frequent.
constexpr double kContradiction = 36.0;
/// Sigmas of a jump of the clock, and the time for which it is reported [us]: the displaced
/// landmarks leave their error ellipses later, since the graph yields slowly.
constexpr double kJump_sigmas = 4.25;
constexpr model::Utime kRemembered_us = 10'000'000;
/// Time for which odometry without scans is kept [us].
constexpr model::Utime kKept_us = 10'000'000;
/// Time before and after a motion over which a twist is averaged [us]. It is outside the motion:
/// the error of the motion's wheels would be taken for lateness.
constexpr model::Utime kTwist_us = 200'000;
/// Successive increments of other sensors than before, after which the sensors have changed.
constexpr int kOtherIncrements = 10;
/// A shorter translation is a standstill.
constexpr double kStands_m = 0.05;
constexpr double kStands_rad = 0.02;
/// Most motions that wait for odometry.
constexpr std::size_t kMostWaiting = 50;

/// Only one thing is wrong at a time; the gyro's bias is always unknown.
constexpr int kMountFree[] = {kYaw, kPlace, kPlace + 1, kGyroBias};
constexpr int kClockFree[] = {kLate, kGyroBias};
constexpr int kScaleFree[] = {kScale, kGyroBias};

CalibrationMatrix prior() { return kPrior_sigma.cwiseAbs2().cwiseInverse().asDiagonal(); }

double seconds_between(model::Utime from, model::Utime to) {
  return 1e-6 * static_cast<double>(to - from);
}

}  // namespace

void CalibrationWatch::add(const model::Odometry& increment) {
  odometry_.add(increment);
  odometry_.forget_before(increment.utime - kKept_us);
  if (!increment.has_wheels) wheels_since_ = increment.utime;
  note_sensors(increment);
}

/// Odometry that loses or regains IMU or wheels is another measurement: errors of the one are not
/// errors of the other.
void CalibrationWatch::note_sensors(const model::Odometry& increment) {
  const bool has_inertial = increment.inertial.has_value();
  const bool is_other = has_inertial != has_inertial_ || increment.has_wheels != has_wheels_;
  other_increments_ = is_other ? other_increments_ + 1 : 0;
  if (other_increments_ < kOtherIncrements) return;
  has_inertial_ = has_inertial;
  has_wheels_ = increment.has_wheels;
  other_increments_ = 0;
  minutes_ = Memory(kMinutes_s);
  seconds_ = Memory(kSeconds_s);
  waiting_.clear();
  jump_.begin_anew();
}

std::optional<Eigen::Vector3d> CalibrationWatch::twist_over(model::Utime from,
                                                            model::Utime to) const {
  const auto motion = odometry_.between(from, to);
  if (!motion) return std::nullopt;
  return motion->mean.Log() / seconds_between(from, to);
}

std::optional<TwoMotions> CalibrationWatch::two_motions(const model::ScanMotion& motion) const {
  const model::Utime then = motion.then_utime;
  const model::Utime now = motion.now_utime;
  const auto by_odometry = odometry_.between(then, now);
  if (!by_odometry) return std::nullopt;

  // The twists at both stamps, interpolated linearly between the middles of two windows. A constant
  // twist contains no information on lateness; if one of the two is unknown, a constant one is
  // assumed.
  const auto before = twist_over(then - kTwist_us, then);
  const auto after = twist_over(now, now + kTwist_us);
  const double seconds = seconds_between(then, now);
  const double window_s = seconds_between(0, kTwist_us);
  const Eigen::Vector3d mean = by_odometry->mean.Log() / seconds;
  const Eigen::Vector3d change =
      before && after ? Eigen::Vector3d(*after - *before) : Eigen::Vector3d::Zero();
  const Eigen::Vector3d to_stamp = 0.5 * window_s / (seconds + window_s) * change;
  const auto gyro = odometry_.gyro_rotation(then, now);
  return TwoMotions{.by_landmarks = motion.then_T_now,
                    .by_odometry = *by_odometry,
                    .then_twist = before && after ? Eigen::Vector3d(*before + to_stamp) : mean,
                    .now_twist = before && after ? Eigen::Vector3d(*after - to_stamp) : mean,
                    .gyro_variance = gyro ? gyro->variance : by_odometry->covariance(2, 2),
                    .seconds = seconds,
                    .has_wheels = then >= wheels_since_};
}

void CalibrationWatch::add(const model::ScanMotion& motion) {
  waiting_.push_back(motion);
  if (waiting_.size() > kMostWaiting) waiting_.pop_front();
  const auto& increments = odometry_.increments();
  while (!increments.empty() && !waiting_.empty() &&
         waiting_.front().now_utime + kTwist_us <= increments.back().utime) {
    compare(waiting_.front());
    waiting_.pop_front();
  }
}

void CalibrationWatch::compare(const model::ScanMotion& motion) {
  const auto motions = two_motions(motion);
  if (!motions) return;
  const double passed_s = seconds_between(last_utime_, motion.now_utime);
  last_utime_ = motion.now_utime;
  // Motions from one scan share its noise.
  const bool is_other_start = motion.then_utime > last_start_utime_;
  last_start_utime_ = motion.then_utime;
  const bool is_due = motions->has_wheels && motion.now_utime >= due_utime_;
  if (is_due) due_utime_ = motion.now_utime + (motion.now_utime - motion.then_utime) / 2;

  for (Memory* memory : {&minutes_, &seconds_}) {
    memory->forget(passed_s);
    if (is_other_start) memory->compare_turns(*motions, std::max(1.0, motions->seconds / passed_s));
    if (is_due) memory->compare_ways(*motions);
  }
}

void CalibrationWatch::watch(model::Utime now, const std::optional<model::ScanMotion>& motion) {
  const auto motions = motion ? two_motions(*motion) : std::nullopt;
  if (motions && motions->has_wheels) {
    const CalibrationMatrix covariance = minutes_.covariance();
    jump_.add(*motions, covariance * minutes_.gradient(), covariance);
    if (std::abs(jump_.late_sigmas()) > kJump_sigmas) jumped_utime_ = now;
  } else {
    jump_.begin_anew();
  }
  has_jumped_ = jumped_utime_ && now - *jumped_utime_ < kRemembered_us;
}

void CalibrationWatch::check(const std::optional<model::ScanMotion>& step) {
  contradicts_ = false;
  if (!step) return;
  const auto motions = two_motions(*step);
  if (!motions) return;
  for (Memory* memory : {&minutes_, &seconds_}) memory->compare_steps(*motions);
  contradicts_ = motions->has_wheels && minutes_.contradiction(*motions) > kContradiction;
}

double CalibrationWatch::Memory::contradiction(const TwoMotions& motions) const {
  const WayDifference difference = way_difference(motions);
  const CalibrationMatrix covariance = this->covariance();
  const Eigen::Vector2d error = difference.value_m - difference.jacobian * (covariance * gradient_);
  const Eigen::Matrix2d uncertain =
      difference.covariance_m2 + difference.jacobian * covariance * difference.jacobian.transpose();
  return error.dot(uncertain.inverse() * error);
}

void CalibrationWatch::Memory::compare_steps(const TwoMotions& motions) {
  const double turn = (motions.by_odometry.mean.inverse() * motions.by_landmarks.mean).theta();
  const double variance = motions.by_landmarks.covariance(2, 2) +
                          motions.by_odometry.covariance(2, 2) + kStepModel_rad * kStepModel_rad;
  const double by_bias = turned_rad_ / (turned_s_ + kNoBias_s) * motions.seconds;
  const double chi2 = (turn - by_bias) * (turn - by_bias) / variance;
  if (!std::isfinite(chi2)) return;

  const double kept = std::exp(-motions.seconds / memory_s_);
  turn_chi2_ = kept * turn_chi2_ + std::min(chi2, kMostTurnChi2);
  turns_ = kept * turns_ + 1.0;
  turned_rad_ = kept * turned_rad_ + turn;
  turned_s_ = kept * turned_s_ + motions.seconds;
  const Eigen::Vector3d squared = motions.now_twist.cwiseAbs2();
  moved_m2ps_ = kept * moved_m2ps_ + motions.seconds * squared.head<2>().sum();
  moved_rad2ps_ = kept * moved_rad2ps_ + motions.seconds * squared.z();
}

void CalibrationWatch::Memory::forget(double passed_s) {
  const double kept = std::exp(-passed_s / memory_s_);
  information_ *= kept;
  gradient_ *= kept;
}

void CalibrationWatch::Memory::compare_turns(const TwoMotions& motions, double overlapping) {
  const TurnDifference difference = turn_difference(motions, overlapping);
  const CalibrationNumbers estimate = (information_ + prior()).llt().solve(gradient_);
  const double sigmas = std::abs(difference.value_rad - difference.jacobian.dot(estimate)) /
                        std::sqrt(difference.variance_rad2);
  if (!std::isfinite(sigmas)) return;
  const double weight = 1.0 / (difference.variance_rad2 * std::max(1.0, sigmas / kRobustTurn));
  information_ += weight * difference.jacobian.transpose() * difference.jacobian;
  gradient_ += weight * difference.value_rad * difference.jacobian.transpose();
}

void CalibrationWatch::Memory::compare_ways(const TwoMotions& motions) {
  // A stationary vehicle measures no mounting, whatever the gyro says.
  if (motions.by_odometry.mean.translation().norm() < kStands_m &&
      std::abs(motions.by_landmarks.mean.theta()) < kStands_rad)
    return;
  const WayDifference difference = way_difference(motions);
  const Eigen::Matrix2d weight = difference.covariance_m2.inverse();
  if (!weight.allFinite() || !difference.value_m.allFinite()) return;
  const Eigen::Matrix<double, kCalibrationNumbers, 2> weighted =
      difference.jacobian.transpose() * weight;
  information_ += weighted * difference.jacobian;
  gradient_ += weighted * difference.value_m;
}

CalibrationMatrix CalibrationWatch::Memory::covariance() const {
  return (information_ + prior()).inverse();
}

CalibrationWatch::Memory::Account CalibrationWatch::Memory::account(
    std::span<const int> free) const {
  const auto count = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd information(count, count);
  Eigen::VectorXd gradient(count);
  const CalibrationMatrix all = information_ + prior();
  for (Eigen::Index i = 0; i < count; ++i) {
    const int row = free[static_cast<std::size_t>(i)];
    gradient(i) = gradient_(row);
    for (Eigen::Index j = 0; j < count; ++j)
      information(i, j) = all(row, free[static_cast<std::size_t>(j)]);
  }

  const Eigen::VectorXd solution = information.llt().solve(gradient);
  Account result;
  for (Eigen::Index i = 0; i < count; ++i)
    result.numbers(free[static_cast<std::size_t>(i)]) = solution(i);
  result.chi2 = gradient.dot(solution);
  return result;
}

CalibrationError CalibrationWatch::Memory::error() const {
  const CalibrationMatrix covariance = this->covariance();
  const CalibrationNumbers estimate = covariance * gradient_;
  const CalibrationNumbers sigma = covariance.diagonal().cwiseSqrt();
  const double seconds = turned_s_ + kNoBias_s;
  CalibrationError error;
  error.yaw_rad = estimate(kYaw);
  error.yaw_sigma_rad = sigma(kYaw);
  error.place_m = estimate.segment<2>(kPlace);
  error.place_sigma_m = sigma.segment<2>(kPlace);
  const Account mount = account(kMountFree);
  error.mount_yaw_rad = mount.numbers(kYaw);
  error.mount_place_m = mount.numbers.segment<2>(kPlace);
  const double sensor_chi2 = std::max(mount.chi2, account(kClockFree).chi2);
  error.sensor_sigmas = std::sqrt(std::max(0.0, sensor_chi2 - account(kScaleFree).chi2));
  error.scale = estimate(kScale);
  error.scale_sigma = sigma(kScale);
  error.turn_chi2 = (turn_chi2_ + kStatedTurns) / (turns_ + kStatedTurns);
  // Rotations that scatter by more than stated give less information in proportion.
  error.late_s = estimate(kLate);
  error.late_sigma_s = sigma(kLate) * std::sqrt(std::max(1.0, error.turn_chi2));
  error.speed_mps = std::sqrt(moved_m2ps_ / seconds);
  error.rate_rad_s = std::sqrt(moved_rad2ps_ / seconds);
  return error;
}

}  // namespace understory::keyframer::joint
