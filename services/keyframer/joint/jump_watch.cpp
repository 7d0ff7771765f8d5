#include "services/keyframer/joint/jump_watch.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace understory::keyframer::joint {
namespace {

/// Motions over which the scatter is averaged: 20 s at 10 Hz.
constexpr double kMemory = 200.0;
/// A motion adds to the scatter at most this multiple of the present scatter: so a jump does not
/// raise it.
constexpr double kMostScatter = 4.0;
/// Variance of odometry in the mean of motions that each overlap the next, as a share of that of
/// one motion: white noise under a triangular window.
constexpr double kOverlap = 2.0 / 3.0;

}  // namespace

void JumpWatch::add(const TwoMotions& motions, const CalibrationNumbers& calibration,
                    const CalibrationMatrix& covariance) {
  // Effect of the calibration error on the motion, in the axes of its end.
  const Eigen::Matrix2d end_R_start = motions.by_odometry.mean.rotation().transpose();
  Eigen::Matrix<double, 3, kCalibrationNumbers> jacobian;
  jacobian.topRows<2>() = end_R_start * way_difference(motions).jacobian;
  jacobian.row(2) = turn_difference(motions, 1.0).jacobian;

  Left& left = motions_[count_ % kScans];
  left.value = (motions.by_odometry.mean.inverse() * motions.by_landmarks.mean).Log() -
               jacobian * calibration;
  // All motions share the calibration's error: it does not average out.
  left.landmarks = motions.by_landmarks.covariance;
  left.odometry =
      motions.by_odometry.covariance + jacobian * covariance * jacobian.transpose() / kOverlap;
  if (!left.value.allFinite() || !left.landmarks.allFinite()) return begin_anew();
  if (++count_ < kScans) return;

  const Left mean = this->mean();
  const Eigen::Vector3d jump = -motions.now_twist;  // By one second.
  const Eigen::Vector3d weighted = (mean.landmarks + mean.odometry).inverse() * jump;
  const double stated = weighted.dot(mean.value) / std::sqrt(weighted.dot(jump));
  if (!std::isfinite(stated)) return begin_anew();
  late_sigmas_ = stated / std::sqrt(std::max(1.0, scatter_));

  const double counted = std::min(stated * stated, kMostScatter * std::max(1.0, scatter_));
  scatter_ += (counted - scatter_) / kMemory;
}

JumpWatch::Left JumpWatch::mean() const {
  constexpr double kShare = 1.0 / static_cast<double>(kScans);
  Left mean;
  for (const Left& one : motions_) {
    mean.value += kShare * one.value;
    mean.landmarks += kShare * kShare * one.landmarks;
    mean.odometry += kShare * kOverlap * one.odometry;
  }
  return mean;
}

}  // namespace understory::keyframer::joint
