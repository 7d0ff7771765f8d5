// Where is this keyframe? By prediction and gating, else by search in the whole map.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <unordered_map>

#include "common/geometry/registration.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Beyond the field of view, so that a landmark at its edge is found whatever the pose's error.
constexpr double kViewMargin_m = 5.0;
/// Landmarks whose exact covariance relative to the vehicle is computed at most. It varies slowly
/// over a part of the map that was seen at one time: the others take their nearest one's.
constexpr std::size_t kMaxExact = 8;
/// So many landmarks cannot contradict the filter.
constexpr std::size_t kFewLandmarks = 2;
/// Over longer times the filter drifts, too.
constexpr model::Utime kFilterGate_us = 3'000'000;

double plane_variance(const model::KeyframeLandmark& landmark) {
  return 0.5 * landmark.covariance_m2.trace();
}

double squared_distance(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return (a - b).squaredNorm();
}

/// Up to `most` of the points, each the one furthest from those before it.
std::vector<std::size_t> spread(std::span<const Eigen::Vector2d> points, std::size_t most) {
  std::vector<std::size_t> chosen;
  std::vector<double> nearest(points.size(), std::numeric_limits<double>::infinity());
  while (chosen.size() < std::min(most, points.size())) {
    const auto furthest = std::max_element(nearest.begin(), nearest.end());
    chosen.push_back(static_cast<std::size_t>(furthest - nearest.begin()));
    for (std::size_t i = 0; i < points.size(); ++i) {
      nearest[i] = std::min(nearest[i], squared_distance(points[i], points[chosen.back()]));
    }
  }
  return chosen;
}

}  // namespace

std::optional<SmoothingMapper::Prediction> SmoothingMapper::predict(
    const model::Keyframe& keyframe) const {
  const geometry::SE2WithCovariance base_T_centre = inverse(
      geometry::SE2WithCovariance{keyframe.centre_T_base(), keyframe.members.front().covariance});
  if (const auto motion = motion_since_last(keyframe.utime)) {
    const geometry::SE2WithCovariance map_T_centre{
        smoother_.pose(nodes_[last_member_->node].centre), Eigen::Matrix3d::Zero()};
    const geometry::SE2WithCovariance map_T_base =
        compound(compound(map_T_centre, last_member_->centre_T_vehicle), *motion);
    return Prediction{compound(map_T_base, base_T_centre), true};
  }
  if (!map_T_last_base_ || !keyframe.previous_T_base) return std::nullopt;
  const double t = parameters_.predicted_sigma_m * parameters_.predicted_sigma_m;
  const double r = parameters_.predicted_sigma_rad * parameters_.predicted_sigma_rad;
  const geometry::SE2WithCovariance motion{*keyframe.previous_T_base,
                                           Eigen::Vector3d(t, t, r).asDiagonal()};
  return Prediction{
      compound({map_T_last_base_->mean * motion.mean, motion.covariance}, base_T_centre), false};
}

std::vector<model::LandmarkId> SmoothingMapper::landmarks_in_view(
    const model::Keyframe& keyframe, const geometry::SE2WithCovariance& guess) const {
  double reach = 0.0;
  for (const model::KeyframeLandmark& landmark : keyframe.landmarks) {
    reach = std::max(reach, landmark.position_m.norm());
  }
  const double spread = std::sqrt(guess.covariance.topLeftCorner<2, 2>().trace());
  return store_.index().near({guess.mean.translation(), reach + kViewMargin_m + 3.0 * spread});
}

/// Variance [m^2] of points relative to the vehicle, as the graph has it. Empty where it cannot
/// say.
std::vector<double> SmoothingMapper::exact_variances(
    std::span<const factor_graph::plane::PointId> points) const {
  std::vector<double> variances;
  const factor_graph::plane::PoseId centre = nodes_[last_member_->node].centre;
  const auto joint = smoother_.joint_marginal({&centre, 1}, points);
  if (!joint) return variances;
  const geometry::SE2 map_T_centre = smoother_.pose(centre);
  for (std::size_t i = 0; i < points.size(); ++i) {
    // d(landmark in the vehicle's frame) / d(pose, landmark)
    const factor_graph::plane::ObservationJacobian j =
        factor_graph::plane::linearise(map_T_centre, smoother_.point(points[i]));
    const auto at = 3 + 2 * static_cast<Eigen::Index>(i);
    const Eigen::Matrix2d cross = j.pose * joint->block<3, 2>(0, at) * j.point.transpose();
    const Eigen::Matrix2d covariance = j.pose * joint->topLeftCorner<3, 3>() * j.pose.transpose() +
                                       j.point * joint->block<2, 2>(at, at) * j.point.transpose() +
                                       cross + cross.transpose();
    variances.push_back(0.5 * covariance.trace());
  }
  return variances;
}

/// Variance [m^2] of each landmark's position relative to the vehicle. What was seen lately shares
/// the vehicle's error; for the others (a loop is closing) the graph is asked.
std::vector<double> SmoothingMapper::relative_variances(
    const std::vector<model::LandmarkId>& ids) const {
  std::vector<double> variances;
  std::vector<std::size_t> old;
  std::vector<factor_graph::plane::PointId> points;
  std::vector<Eigen::Vector2d> positions;
  for (const model::LandmarkId id : ids) {
    const StoredLandmark& landmark = store_.at(id);
    variances.push_back(landmark.local_variance());
    const bool recent =
        landmark.last_keyframe + static_cast<std::uint32_t>(parameters_.recent_keyframes) >=
        keyframes_;
    if (recent || !landmark.point) continue;
    old.push_back(variances.size() - 1);
    points.push_back(*landmark.point);
    positions.push_back(landmark.position_m);
  }
  if (old.empty() || !last_member_) return variances;
  const std::vector<std::size_t> asked = spread(positions, kMaxExact);
  std::vector<factor_graph::plane::PointId> asked_points;
  asked_points.reserve(asked.size());
  for (const std::size_t i : asked) asked_points.push_back(points[i]);
  const std::vector<double> exact = exact_variances(asked_points);
  if (exact.empty()) return variances;
  for (std::size_t i = 0; i < old.size(); ++i) {
    std::size_t nearest = 0;
    for (std::size_t k = 1; k < asked.size(); ++k) {
      if (squared_distance(positions[i], positions[asked[k]]) <
          squared_distance(positions[i], positions[asked[nearest]])) {
        nearest = k;
      }
    }
    variances[old[i]] = std::max(variances[old[i]], exact[nearest]);
  }
  return variances;
}

SmoothingMapper::Placement SmoothingMapper::associate(
    const model::Keyframe& keyframe, const geometry::SE2WithCovariance& guess) const {
  const std::vector<model::LandmarkId> ids = landmarks_in_view(keyframe, guess);
  const std::vector<double> variances = relative_variances(ids);
  std::vector<geometry::UncertainPoint> reference;
  for (std::size_t i = 0; i < ids.size(); ++i)
    reference.push_back({store_.at(ids[i]).position_m, variances[i]});
  std::vector<geometry::UncertainPoint> observed;
  for (const model::KeyframeLandmark& seen : keyframe.landmarks)
    observed.push_back({seen.position_m, plane_variance(seen)});
  geometry::RegistrationParameters gating;
  gating.gate_sigmas = parameters_.gate_sigmas;
  gating.gate_floor_m = parameters_.gate_floor_m;
  const geometry::SE2WithCovariance broad{guess.mean,
                                          guess.covariance + 1e-8 * Eigen::Matrix3d::Identity()};
  const geometry::Registration found = register_points(reference, observed, broad, gating);
  Placement placement{{found.reference_T_observed, found.covariance}, {}, true};
  for (const geometry::PointPair& pair : found.pairs) {
    if (keyframe.landmarks[pair.observed].kind != store_.at(ids[pair.reference]).kind) continue;
    placement.associations.push_back({pair.observed, ids[pair.reference]});
  }
  return placement;
}

/// How many of the keyframe's landmarks could be in the map: not more than the map has in the field
/// of view.
std::size_t SmoothingMapper::matchable(const model::Keyframe& keyframe,
                                       const Placement& placement) const {
  std::size_t in_view = 0;
  const geometry::SE2 vehicle_T_map =
      (placement.map_T_centre.mean * keyframe.centre_T_base()).inverse();
  const double range = keyframe.field_of_view.max_range_m;
  store_.index().for_each_within(placement.map_T_centre.mean.translation(), range + kViewMargin_m,
                                 [&](model::LandmarkId, const Eigen::Vector2d& position, double) {
                                   if (keyframe.field_of_view.contains(vehicle_T_map * position))
                                     ++in_view;
                                 });
  return std::min(in_view, keyframe.landmarks.size());
}

std::optional<SmoothingMapper::Placement> SmoothingMapper::track(
    const model::Keyframe& keyframe, const Prediction& prediction) const {
  Placement placement = associate(keyframe, prediction.map_T_centre);
  const std::size_t possible = matchable(keyframe, placement);
  const std::size_t matched = placement.associations.size();
  const bool enough =
      static_cast<double>(matched) >= parameters_.min_matched_ratio * static_cast<double>(possible);
  if (prediction.from_odometry) {
    if (enough || possible < static_cast<std::size_t>(parameters_.min_matched)) return placement;
    return std::nullopt;
  }
  if (enough && matched >= static_cast<std::size_t>(parameters_.min_matched)) return placement;
  return std::nullopt;
}

std::optional<SmoothingMapper::Placement> SmoothingMapper::search(const model::Keyframe& keyframe,
                                                                  model::MapUpdate& update) const {
  std::vector<constellation::ObservedPoint> points;
  for (const model::KeyframeLandmark& seen : keyframe.landmarks) {
    points.push_back({seen.position_m, std::sqrt(plane_variance(seen))});
  }
  const constellation::Localisation found = store_.index().localise(points);
  update.candidates = found.hypotheses;
  update.log10_false_alarm = found.log10_false_alarm;
  if (!found.found()) {
    update.reason = describe(found.outcome);
    return std::nullopt;
  }
  Placement placement = associate(keyframe, {found.map_T_sensor, found.covariance});
  placement.by_prediction = false;
  if (placement.associations.size() < static_cast<std::size_t>(parameters_.min_matched)) {
    update.reason = "the place found does not hold on closer look";
    return std::nullopt;
  }
  return placement;
}

/// Somebody who walks, taken for the only trunk in view, would take the map along.
bool SmoothingMapper::contradicts_filter(const model::Keyframe& keyframe,
                                         const Placement& placement) const {
  const double limit = parameters_.filter_disagreement_m;
  if (limit <= 0.0 || placement.associations.size() > kFewLandmarks) return false;
  const auto differs = [&](model::Utime from, model::Utime to, const geometry::SE2& motion) {
    const std::optional<geometry::SE2> told = filter_.between(from, to);
    return told && (told->inverse() * motion).translation().norm() > limit;
  };
  const model::KeyframeMember& first = keyframe.members.front();
  const model::KeyframeMember& last = keyframe.members.back();
  if (differs(first.utime, last.utime, first.centre_T_vehicle.inverse() * last.centre_T_vehicle)) {
    return true;
  }
  if (bases_.empty() || bases_.back().utime + kFilterGate_us < keyframe.utime) return false;
  const geometry::SE2 map_T_base = placement.map_T_centre.mean * keyframe.centre_T_base();
  return differs(bases_.back().utime, keyframe.utime,
                 base_pose(bases_.back()).mean.inverse() * map_T_base);
}

}  // namespace understory::geoslam_mapper::smoothing
