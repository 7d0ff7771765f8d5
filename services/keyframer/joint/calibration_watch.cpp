#include "services/keyframer/joint/calibration_watch.hpp"

#include <Eigen/LU>
#include <cmath>

namespace understory::keyframer::joint {
namespace {

/// What is known before the first comparison: yaw [rad], place [m], scale.
const Eigen::Vector4d kPrior_sigma(0.2, 1.0, 1.0, 0.2);
/// Error of a comparison that neither covariance has, as a share of the way: slip, levelling.
constexpr double kModelShare = 0.01;
/// The same of a turn [rad]: levelling, the bias's walk.
constexpr double kTurnModel_rad = 5e-4;
/// chi^2 of a turn that counts at most: a wrong pair must not decide.
constexpr double kMostTurnChi2 = 25.0;
/// Weight of the statement against what the turns show.
constexpr double kStatedTurns = 50.0;
/// Weight of "no bias" [s].
constexpr double kNoBias_s = 2.0;
/// chi^2 of 2 degrees of freedom beyond which two ways contradict each other: by chance once in
/// 10^7. Errors that neither covariance has make it far more frequent.
constexpr double kContradiction = 36.0;
/// Odometry that no scan has asked for is kept so long [us].
constexpr model::Utime kKept_us = 10'000'000;

Eigen::Matrix4d prior() { return kPrior_sigma.cwiseAbs2().cwiseInverse().asDiagonal(); }

/// The difference of two ways, and what (psi, e, s) would make of it.
struct Difference {
  Eigen::Vector2d value_m;
  Eigen::Matrix2d covariance_m2;
  Eigen::Matrix<double, 2, 4> jacobian;
};

Difference difference_of(const geometry::SE2WithCovariance& by_landmarks,
                         const geometry::SE2WithCovariance& by_odometry) {
  const Eigen::Vector2d way = by_odometry.mean.translation();
  const Eigen::Matrix2d rotation = by_odometry.mean.rotation();
  const Eigen::Matrix3d sum = by_landmarks.covariance + by_odometry.covariance;
  Difference result;
  result.value_m = by_landmarks.mean.translation() - way;
  result.covariance_m2 =
      rotation * sum.topLeftCorner<2, 2>() * rotation.transpose() +
      kModelShare * kModelShare * way.squaredNorm() * Eigen::Matrix2d::Identity();
  result.jacobian << geometry::perpendicular(way), Eigen::Matrix2d::Identity() - rotation, -way;
  return result;
}

}  // namespace

void CalibrationWatch::add(const model::Odometry& increment) {
  odometry_.add(increment);
  odometry_.forget_before(increment.utime - kKept_us);
  if (!increment.has_wheels) wheels_since_ = increment.utime;
}

std::optional<CalibrationWatch::Both> CalibrationWatch::both_of(
    const model::ScanMotion& motion) const {
  const auto by_odometry = odometry_.between(motion.then_utime, motion.now_utime);
  if (!by_odometry) return std::nullopt;
  return Both{motion.then_T_now, *by_odometry,
              1e-6 * static_cast<double>(motion.now_utime - motion.then_utime),
              motion.then_utime >= wheels_since_};
}

void CalibrationWatch::add(const model::ScanMotion& motion) {
  const auto both = both_of(motion);
  if (!both) return;
  due_utime_ = motion.now_utime + (motion.now_utime - motion.then_utime) / 2;
  if (!both->has_wheels) return;
  for (Memory* memory : {&minutes_, &seconds_}) memory->compare_ways(*both);
}

void CalibrationWatch::check(const std::optional<model::ScanMotion>& step) {
  contradicts_ = false;
  if (!step) return;
  const auto both = both_of(*step);
  if (!both) return;
  for (Memory* memory : {&minutes_, &seconds_}) memory->compare_turns(*both);
  contradicts_ = both->has_wheels && minutes_.contradiction(*both) > kContradiction;
}

double CalibrationWatch::Memory::contradiction(const Both& both) const {
  const Difference difference = difference_of(both.by_landmarks, both.by_odometry);
  const Eigen::Matrix4d covariance = (information_ + prior()).inverse();
  const Eigen::Vector2d error = difference.value_m - difference.jacobian * (covariance * gradient_);
  const Eigen::Matrix2d uncertain =
      difference.covariance_m2 + difference.jacobian * covariance * difference.jacobian.transpose();
  return error.dot(uncertain.inverse() * error);
}

void CalibrationWatch::Memory::compare_turns(const Both& both) {
  const double turn = (both.by_odometry.mean.inverse() * both.by_landmarks.mean).theta();
  const double variance = both.by_landmarks.covariance(2, 2) + both.by_odometry.covariance(2, 2) +
                          kTurnModel_rad * kTurnModel_rad;
  const double by_bias = turned_rad_ / (turned_s_ + kNoBias_s) * both.seconds;
  const double chi2 = (turn - by_bias) * (turn - by_bias) / variance;
  if (!std::isfinite(chi2)) return;

  const double kept = std::exp(-both.seconds / memory_s_);
  turn_chi2_ = kept * turn_chi2_ + std::min(chi2, kMostTurnChi2);
  turns_ = kept * turns_ + 1.0;
  turned_rad_ = kept * turned_rad_ + turn;
  turned_s_ = kept * turned_s_ + both.seconds;
}

void CalibrationWatch::Memory::compare_ways(const Both& both) {
  const Difference difference = difference_of(both.by_landmarks, both.by_odometry);
  const Eigen::Matrix2d weight = difference.covariance_m2.inverse();
  if (!weight.allFinite() || !difference.value_m.allFinite()) return;
  const double kept = std::exp(-0.5 * both.seconds / memory_s_);
  const Eigen::Matrix<double, 4, 2> weighted = difference.jacobian.transpose() * weight;
  information_ = kept * information_ + weighted * difference.jacobian;
  gradient_ = kept * gradient_ + weighted * difference.value_m;
}

CalibrationError CalibrationWatch::Memory::error() const {
  const Eigen::Matrix4d covariance = (information_ + prior()).inverse();
  const Eigen::Vector4d estimate = covariance * gradient_;
  const Eigen::Vector4d sigma = covariance.diagonal().cwiseSqrt();
  return {estimate(0),
          sigma(0),
          estimate.segment<2>(1),
          sigma.segment<2>(1),
          estimate(3),
          sigma(3),
          (turn_chi2_ + kStatedTurns) / (turns_ + kStatedTurns)};
}

}  // namespace understory::keyframer::joint
