// What odometry says of the way between keyframes.
#include <Eigen/LU>
#include <cmath>

#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Keeps an exactly known motion invertible: a micrometre, a microradian.
const Eigen::Matrix3d kTiny = 1e-12 * Eigen::Matrix3d::Identity();

/// The motion with the gyro's turn for its own.
factor_graph::plane::RelativePose turned_by(const model::GyroRotation& gyro,
                                            factor_graph::plane::RelativePose motion,
                                            Eigen::Matrix3d covariance) {
  motion.a_T_b = geometry::SE2(motion.a_T_b.translation(), gyro.rotation_rad);
  const double ratio = std::sqrt(gyro.variance / covariance(2, 2));
  covariance.row(2) *= ratio;
  covariance.col(2) *= ratio;
  motion.information = covariance.inverse();
  return motion;
}

}  // namespace

std::optional<geometry::SE2WithCovariance> SmoothingMapper::motion_since_last(
    model::Utime utime) const {
  if (!parameters_.use_odometry || !last_member_) return std::nullopt;
  return odometry_.between(last_member_->utime, utime);
}

/// From the keyframe's first member to its centre by the gyro. The gauge of a keyframe leaves the
/// members' errors with no mean: so the centre is where the gyro has the members' mean, and what
/// the landmarks say of turns within the keyframe does not enter, nor is it lost to the gyro's
/// bias.
std::optional<model::GyroRotation> SmoothingMapper::rotation_to_centre(
    const model::Keyframe& keyframe) const {
  model::GyroRotation mean;
  double centre_T_mean = 0.0;
  for (const model::KeyframeMember& member : keyframe.members) {
    const auto turn = odometry_.gyro_rotation(keyframe.utime, member.utime);
    if (!turn) return std::nullopt;
    mean += *turn;
    centre_T_mean += member.centre_T_vehicle.theta();
  }
  const double share = 1.0 / static_cast<double>(keyframe.members.size());
  return model::GyroRotation{share * (mean.rotation_rad - centre_T_mean), share * mean.variance,
                             share * mean.seconds, share * mean.bias_rad};
}

/// Where odometry goes on after the keyframe.
SmoothingMapper::LastMember SmoothingMapper::last_of(const model::Keyframe& keyframe,
                                                     const Base& base) const {
  const model::KeyframeMember& last = keyframe.members.back();
  // A folded keyframe's members are given in its own centre; the base ties that to the node's.
  const geometry::SE2 node_T_keyframe =
      base.centre_T_base.mean * keyframe.centre_T_base().inverse();
  LastMember result{
      base.node, last.utime, {node_T_keyframe * last.centre_T_vehicle, last.covariance}, {}};
  const auto to_centre = rotation_to_centre(keyframe);
  const auto whole = odometry_.gyro_rotation(keyframe.utime, last.utime);
  if (to_centre && whole) {
    result.turn = model::GyroRotation{
        node_T_keyframe.theta() + whole->rotation_rad - to_centre->rotation_rad,
        whole->variance - to_centre->variance, whole->seconds - to_centre->seconds,
        whole->bias_rad - to_centre->bias_rad};
  }
  return result;
}

void SmoothingMapper::add_motion(const model::Keyframe& keyframe, NodeIndex node) {
  const auto motion = motion_since_last(keyframe.utime);
  if (!motion) return;
  if (last_member_->node == node) return gyro_.stood();
  const geometry::SE2WithCovariance centre_T_base{keyframe.centre_T_base(),
                                                  keyframe.members.front().covariance};
  const geometry::SE2WithCovariance last_T_centre =
      compound(compound(last_member_->centre_T_vehicle, *motion), inverse(centre_T_base));
  const Eigen::Matrix3d covariance = last_T_centre.covariance + kTiny;
  const factor_graph::plane::RelativePose relative{nodes_[last_member_->node].centre,
                                                   nodes_[node].centre, last_T_centre.mean,
                                                   covariance.inverse()};
  const auto between = odometry_.gyro_rotation(last_member_->utime, keyframe.utime);
  const auto to_centre = rotation_to_centre(keyframe);
  const auto filter = odometry_.filter_bias();
  if (!gyro_.is_estimated() || !filter || !last_member_->turn || !between || !to_centre)
    return smoother_.add(relative);
  model::GyroRotation turn = *last_member_->turn;
  turn += *between;
  turn += *to_centre;
  if (turn.seconds <= 0.0 || turn.variance <= 0.0) return smoother_.add(relative);
  gyro_.add_motion(turned_by(turn, relative, covariance), turn, *filter, keyframe.utime, smoother_);
}

}  // namespace understory::geoslam_mapper::smoothing
