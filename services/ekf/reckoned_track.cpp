#include "services/ekf/reckoned_track.hpp"

#include <algorithm>
#include <cmath>

#include "common/geometry/decompositions.hpp"
#include "services/ekf/timeline.hpp"

namespace understory::ekf {
namespace {

/// Number of poses kept: 2.5 s at 50 Hz. A scan arrives some tenths of a second after its stamp.
constexpr std::size_t kKept = 128;
/// Longest extrapolation of a pose by its twist [us]: an increment of odometry begins a tenth of a
/// second before the first pose received after a gap.
constexpr model::Utime kReach_us = 150'000;
/// Largest change of the twist in that time, per axis [m/s^2, m/s^2, rad/s^2].
const Eigen::Vector3d kAcceleration(2.0, 2.0, 0.3);
/// A longer time between poses is a gap [us].
constexpr model::Utime kGap_us = 250'000;
/// A larger jump back begins a new track [us]; a smaller one makes the pose late, and it is
/// skipped.
constexpr model::Utime kJump_us = 1'000'000;
/// With a larger uncertainty of the rotation, dead reckoning had a gap of its own [rad].
constexpr double kSurelyFollowed_rad = 0.15;
/// Relative sigmas of the displacement, along and across it: scale of the wheels, slip, steering.
/// They are constant errors that RAW_POSE does not state, since the filter normally corrects it at
/// each scan.
constexpr double kScale = 0.01;
/// Rounding of an accumulated covariance [m^2, rad^2].
constexpr double kRounding = 1e-10;

bool is_usable(const model::RawPose& pose) {
  return !pose.is_reference && pose.odom_T_vehicle.coordinates().allFinite() &&
         pose.covariance.allFinite() && pose.covariance.diagonal().minCoeff() >= 0.0;
}

}  // namespace

void ReckonedTrack::add(const model::RawPose& pose) {
  if (!is_usable(pose)) return;
  if (!poses_.empty() && pose.utime <= poses_.back().utime) {
    if (pose.utime > poses_.back().utime - kJump_us) return;
    poses_.clear();
  }
  poses_.push_back({pose.utime, pose.odom_T_vehicle, pose.covariance});
  if (poses_.size() > kKept) poses_.pop_front();
}

/// Pose from the twist of the two poses around the stamp, if no gap separates them.
std::optional<ReckonedTrack::Reached> ReckonedTrack::at(model::Utime utime) const {
  for (std::size_t i = 1; i < poses_.size(); ++i) {
    const Pose& a = poses_[i - 1];
    const Pose& b = poses_[i];
    const bool is_beside = utime >= a.utime - kReach_us && utime <= b.utime + kReach_us;
    if (!is_beside || b.utime - a.utime > kGap_us) continue;
    if (utime > b.utime && i + 1 < poses_.size() && poses_[i + 1].utime - b.utime <= kGap_us)
      continue;  // The next two are nearer.

    const Eigen::Vector3d twist =
        (a.odom_T_vehicle.inverse() * b.odom_T_vehicle).Log() / seconds(b.utime - a.utime);
    const geometry::SE2 pose =
        a.odom_T_vehicle * geometry::SE2::Exp(seconds(utime - a.utime) * twist);
    const bool is_nearer_a = utime - a.utime < b.utime - utime;
    const double outside_s = seconds(std::max({a.utime - utime, utime - b.utime, model::Utime{0}}));
    return Reached{{pose, is_nearer_a ? a.covariance : b.covariance},
                   twist,
                   (0.5 * outside_s * outside_s * kAcceleration).cwiseAbs2()};
  }
  return std::nullopt;
}

std::optional<ReckonedMotion> ReckonedTrack::between(model::Utime from, model::Utime to) const {
  const std::optional<Reached> begin = at(from);
  const std::optional<Reached> end = at(to);
  if (!begin || !end) return std::nullopt;

  // The growth of the covariance is that of the motion. If it shrank, another track has begun.
  const geometry::SE2 from_T_to = begin->odom_T_vehicle.mean.inverse() * end->odom_T_vehicle.mean;
  const Eigen::Matrix3d carry = from_T_to.inverse().Adjoint();
  const Eigen::Matrix3d grown =
      end->odom_T_vehicle.covariance - carry * begin->odom_T_vehicle.covariance * carry.transpose();
  const Eigen::Matrix3d symmetric = 0.5 * (grown + grown.transpose());
  const bool is_one_track = geometry::eigenvalues(symmetric).x() > -kRounding;
  const bool is_followed = symmetric(2, 2) < kSurelyFollowed_rad * kSurelyFollowed_rad;
  if (!is_one_track || !is_followed) return std::nullopt;

  const double scale_m = kScale * from_T_to.translation().norm();
  const Eigen::Vector3d scale(scale_m, scale_m, 0.0);
  const Eigen::Vector3d reached =
      begin->variance + end->variance + scale.cwiseAbs2() + Eigen::Vector3d::Constant(kRounding);
  const Eigen::Matrix3d covariance = symmetric + Eigen::Matrix3d(reached.asDiagonal());
  return ReckonedMotion{{from_T_to, covariance}, end->twist_per_s.head<2>()};
}

}  // namespace understory::ekf
