#include "services/geoslam_mapper/smoothing/motion.hpp"

#include <cmath>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Keeps an exactly known motion invertible: a micrometre, a microradian.
const Eigen::Matrix3d kTiny = 1e-12 * Eigen::Matrix3d::Identity();

geometry::SE2WithCovariance centre_T_base(const model::Keyframe& keyframe) {
  return {keyframe.centre_T_base(), keyframe.members.front().covariance};
}

}  // namespace

Motion::Motion(const SmoothingMapperParameters& parameters) : parameters_(parameters) {}

Motion Motion::from_nowhere() const {
  Motion motion(parameters_);
  motion.odometry_ = odometry_;
  motion.stops_ = stops_;
  motion.filter_ = filter_;
  return motion;
}

void Motion::add(const model::Odometry& increment) {
  if (parameters_.use_odometry && odometry_.add(increment)) stops_.add(increment);
}

void Motion::add(const model::EkfPose& pose) {
  odometry_.set_filter_velocity(pose);
  filter_.add(pose);
}

std::optional<geometry::SE2WithCovariance> Motion::between(model::Utime from,
                                                           model::Utime to) const {
  if (!parameters_.use_odometry) return std::nullopt;
  return odometry_.between(from, to);
}

std::optional<model::InertialMotion> Motion::inertial(model::Utime from, model::Utime to) const {
  if (!parameters_.use_odometry) return std::nullopt;
  return odometry_.inertial(from, to);
}

std::optional<Prediction> Motion::predict(const model::Keyframe& keyframe,
                                          const PoseGraph& graph) const {
  const geometry::SE2WithCovariance base_T_centre = inverse(centre_T_base(keyframe));

  if (last_member_) {
    if (const auto motion = between(last_member_->utime, keyframe.utime)) {
      const geometry::SE2WithCovariance map_T_centre{graph.pose(last_member_->node),
                                                     Eigen::Matrix3d::Zero()};
      const geometry::SE2WithCovariance map_T_base =
          compound(compound(map_T_centre, last_member_->centre_T_vehicle), *motion);
      return Prediction{compound(map_T_base, base_T_centre), true};
    }
  }

  if (!map_T_last_base_ || !keyframe.previous_T_base) return std::nullopt;
  const double t = parameters_.predicted_sigma_m * parameters_.predicted_sigma_m;
  const double r = parameters_.predicted_sigma_rad * parameters_.predicted_sigma_rad;
  const geometry::SE2WithCovariance motion{*keyframe.previous_T_base,
                                           Eigen::Vector3d(t, t, r).asDiagonal()};
  return Prediction{
      compound({map_T_last_base_->mean * motion.mean, motion.covariance}, base_T_centre), false};
}

/// Rotation from the keyframe's first member to its centre by the gyro. The gauge of the keyframe
/// fixes the members' errors to zero mean. So the centre is placed at the members' mean by the
/// gyro: then the landmarks' part of rotations within the keyframe is not taken for a bias of the
/// gyro.
std::optional<model::GyroRotation> Motion::rotation_to_centre(
    const model::Keyframe& keyframe) const {
  model::GyroRotation mean;
  double centre_T_mean = 0.0;
  for (const model::KeyframeMember& member : keyframe.members) {
    const auto rotation = odometry_.gyro_rotation(keyframe.utime, member.utime);
    if (!rotation) return std::nullopt;
    mean += *rotation;
    centre_T_mean += member.centre_T_vehicle.theta();
  }

  const double share = 1.0 / static_cast<double>(keyframe.members.size());
  return model::GyroRotation{share * (mean.rotation_rad - centre_T_mean), share * mean.variance,
                             share * mean.seconds, share * mean.bias_rad};
}

/// None also if the vehicle was stationary all the time.
std::optional<model::GyroRotation> Motion::rotation_since_last_centre(
    const model::Keyframe& keyframe) const {
  if (!last_member_->rotation) return std::nullopt;
  const auto between = odometry_.gyro_rotation(last_member_->utime, keyframe.utime);
  const auto to_centre = rotation_to_centre(keyframe);
  if (!between || !to_centre) return std::nullopt;

  model::GyroRotation rotation = *last_member_->rotation;
  rotation += *between;
  rotation += *to_centre;
  if (rotation.seconds <= 0.0 || rotation.variance <= 0.0) return std::nullopt;
  return rotation;
}

std::optional<CentreMotion> Motion::since_last_centre(const model::Keyframe& keyframe) const {
  if (!last_member_) return std::nullopt;
  const auto motion = between(last_member_->utime, keyframe.utime);
  if (!motion) return std::nullopt;

  CentreMotion result;
  result.from = last_member_->node;
  result.utime = keyframe.utime;
  result.from_T_to =
      compound(compound(last_member_->centre_T_vehicle, *motion), inverse(centre_T_base(keyframe)));
  result.from_T_to.covariance += kTiny;
  result.gyro = rotation_since_last_centre(keyframe);
  if (const auto& inertial = odometry_.increments().back().inertial)
    result.odometry_bias = inertial->bias.x();
  result.at_stops = stops_.measured();
  return result;
}

bool Motion::knows_heading(const model::Keyframe& keyframe) const {
  const auto motion = odometry_.between(keyframe.utime, keyframe.members.back().utime);
  if (!motion || odometry_.increments().empty() || !odometry_.increments().back().inertial)
    return true;
  return std::sqrt(motion->covariance(2, 2)) <= parameters_.start_heading_sigma_rad;
}

void Motion::continue_from(const model::Keyframe& keyframe, const Base& base,
                           const geometry::SE2WithCovariance& map_T_base) {
  // The bias from stops is in the graph with the first motion after them.
  if (last_member_ && base.node != last_member_->node && rotation_since_last_centre(keyframe))
    stops_.clear();

  // The members of a folded keyframe are in its own centre frame; the base ties that frame to the
  // node's.
  const model::KeyframeMember& last = keyframe.members.back();
  const geometry::SE2 node_T_keyframe =
      base.centre_T_base.mean * keyframe.centre_T_base().inverse();
  last_member_ = LastMember{
      base.node, last.utime, {node_T_keyframe * last.centre_T_vehicle, last.covariance}, {}};

  // The gyro's rotation from the node's centre to the last member.
  const auto to_centre = rotation_to_centre(keyframe);
  const auto whole = odometry_.gyro_rotation(keyframe.utime, last.utime);
  if (to_centre && whole) {
    last_member_->rotation = model::GyroRotation{
        node_T_keyframe.theta() + whole->rotation_rad - to_centre->rotation_rad,
        whole->variance - to_centre->variance, whole->seconds - to_centre->seconds,
        whole->bias_rad - to_centre->bias_rad};
  }

  map_T_last_base_ = map_T_base;
  odometry_.forget_before(last.utime);
}

void Motion::assume(const model::Keyframe& keyframe, const Prediction& prediction) {
  map_T_last_base_ = compound(prediction.map_T_centre, centre_T_base(keyframe));
}

std::optional<geometry::SE2WithCovariance> Motion::centre_T_last_member() const {
  if (!last_member_) return std::nullopt;
  return last_member_->centre_T_vehicle;
}

}  // namespace understory::geoslam_mapper::smoothing
