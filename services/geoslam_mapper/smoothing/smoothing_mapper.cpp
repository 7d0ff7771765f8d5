#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Keeps an exactly known pose invertible: a micrometre, a microradian.
const Eigen::Matrix3d kTiny = 1e-12 * Eigen::Matrix3d::Identity();

/// Landmarks are told at breast height; the level displaces them by it.
constexpr double kLandmarkHeight_m = 1.3;

factor_graph::plane::SmootherParameters limits(const SmoothingMapperParameters& parameters) {
  factor_graph::plane::SmootherParameters result;
  result.relinearise_above = parameters.relinearise_above;
  result.least_move = std::clamp(0.1 * parameters.relinearise_above, 1e-4, 1e-3);
  return result;
}

bool finite(const model::Keyframe& keyframe) {
  const auto good = [](const model::KeyframeLandmark& l) {
    return l.position_m.allFinite() && l.covariance_m2.allFinite() &&
           l.covariance_m2.determinant() > 0.0 && l.covariance_m2.trace() > 0.0;
  };
  const auto good_member = [](const model::KeyframeMember& m) {
    return m.centre_T_vehicle.coordinates().allFinite() && m.covariance.allFinite();
  };
  return std::all_of(keyframe.landmarks.begin(), keyframe.landmarks.end(), good) &&
         std::all_of(keyframe.members.begin(), keyframe.members.end(), good_member);
}

}  // namespace

SmoothingMapper::SmoothingMapper(const SmoothingMapperParameters& parameters)
    : parameters_(parameters),
      smoother_(limits(parameters)),
      odometry_(parameters.gyro_walk > 0.0 ? 0.0 : model::OdometryBuffer::kBiasCorrelation_s),
      gyro_(parameters.gyro_walk) {}

std::unique_ptr<MapperMethod> make_smoothing_mapper(const SmoothingMapperParameters& parameters) {
  return std::make_unique<SmoothingMapper>(parameters);
}

void SmoothingMapper::add(const model::Odometry& odometry) {
  if (parameters_.use_odometry) odometry_.add(odometry);
}

void SmoothingMapper::start_with(std::span<const model::MapLandmark> landmarks) {
  const double sigma2 = parameters_.given_map_sigma_m * parameters_.given_map_sigma_m;
  for (const model::MapLandmark& given : landmarks) {
    StoredLandmark landmark;
    landmark.position_m = given.position_m;
    const bool stated = given.covariance_m2.determinant() > 0.0;
    landmark.prior_covariance =
        stated ? given.covariance_m2 : Eigen::Matrix2d(sigma2 * Eigen::Matrix2d::Identity());
    landmark.information = 2.0 / landmark.prior_covariance.trace();
    landmark.radius_m = given.radius_m;
    landmark.observation_count = given.observation_count;
    landmark.kind = given.kind;
    if (given.id != 0) {
      landmark.id = given.id;
      store_.restore(landmark);
      store_.set_next_id(std::max(store_.next_id(), given.id + 1));
      changed_.push_back(given.id);
    } else {
      changed_.push_back(store_.insert(landmark));
    }
  }
  map_was_given_ = map_was_given_ || !landmarks.empty();
}

std::string SmoothingMapper::malformed(const model::Keyframe& keyframe) const {
  if (keyframe.members.empty()) return "keyframe without members";
  if (last_utime_ && keyframe.utime <= *last_utime_) return "keyframe not later than the last one";
  if (!finite(keyframe))
    return "keyframe with a value that is not finite or a covariance that is not positive";
  return {};
}

/// One keyframe, from arrival to answer.
model::MapUpdate SmoothingMapper::add(const model::Keyframe& keyframe) {
  model::MapUpdate update;
  update.keyframe_sequence = keyframe.sequence;
  update.utime = keyframe.utime;
  update.reason = malformed(keyframe);
  if (!update.reason.empty()) return update;
  last_utime_ = keyframe.utime;

  if (store_.empty() && nodes_.empty()) {
    if (parameters_.localisation_only) {
      update.status = model::MapUpdateStatus::kNotSure;
      update.reason = "localisation only, but no map was given";
      return update;
    }
    if (may_start(keyframe, update)) start_map(keyframe, update);
    return update;
  }
  const std::optional<Prediction> prediction = predict(keyframe);
  std::optional<Placement> placement;
  if (prediction) placement = track(keyframe, *prediction);
  if (!placement) {
    store_.catch_up();
    placement = search(keyframe, update);
  }
  if (placement && contradicts_filter(keyframe, *placement)) {
    placement.reset();
    update.reason = "few landmarks, and they move otherwise than the filter";
  }
  if (!placement) {
    update.status = model::MapUpdateStatus::kNotSure;
    if (prediction)
      map_T_last_base_ = compound(prediction->map_T_centre,
                                  {keyframe.centre_T_base(), keyframe.members.front().covariance});
    return update;
  }
  update.used_prior = placement->by_prediction;
  update.inliers = static_cast<std::uint32_t>(placement->associations.size());
  if (parameters_.localisation_only) {
    report(keyframe, *placement, update);
    return update;
  }
  if (!fuse(keyframe, *placement, update)) {
    update.status = model::MapUpdateStatus::kRolledBack;
    return update;
  }
  update.status = model::MapUpdateStatus::kUpdated;
  return update;
}

/// Localisation only: the pose is kept, the map stays as it was given. The node has no factor, so
/// nothing moves it.
void SmoothingMapper::report(const model::Keyframe& keyframe, const Placement& placement,
                             model::MapUpdate& update) {
  const geometry::SE2WithCovariance centre_T_base{keyframe.centre_T_base(),
                                                  keyframe.members.front().covariance};
  const NodeIndex node = add_node(placement.map_T_centre.mean, keyframe);
  add_base({node, keyframe.sequence, keyframe.utime, centre_T_base, middle_of(keyframe), false});
  ++keyframes_;
  update.associations = placement.associations;
  finish(keyframe, update);
  map_T_last_base_ = compound(placement.map_T_centre, centre_T_base);
  update.covariance = map_T_last_base_->covariance;
  update.status = model::MapUpdateStatus::kUpdated;
}

/// Before the gyro's bias is known the first scan's heading is not, and it would be the map's.
bool SmoothingMapper::may_start(const model::Keyframe& keyframe, model::MapUpdate& update) {
  if (!parameters_.use_odometry) return true;
  if (!first_offered_) first_offered_ = keyframe.utime;
  const double waited_s = 1e-6 * static_cast<double>(keyframe.utime - *first_offered_);
  if (waited_s >= parameters_.start_wait_s) return true;
  const auto motion = odometry_.between(keyframe.utime, keyframe.members.back().utime);
  if (!motion || !odometry_.increments().back().inertial) return true;
  if (std::sqrt(motion->covariance(2, 2)) <= parameters_.start_heading_sigma_rad) return true;
  update.status = model::MapUpdateStatus::kNotSure;
  update.reason = "the gyro's bias is not known yet";
  return false;
}

/// The first keyframe's base is the origin of the map; where its centre is seen from there is where
/// it stays. How uncertain that is comes in where covariances are told (finish()): as a prior in
/// the graph it would hold the map by 3 mrad, and all that linearisations leave would turn it.
void SmoothingMapper::start_map(const model::Keyframe& keyframe, model::MapUpdate& update) {
  if (keyframe.landmarks.size() < 3 && !parameters_.use_odometry) {
    update.status = model::MapUpdateStatus::kNotSure;
    update.reason = "too few landmarks to start a map";
    return;
  }
  const geometry::SE2WithCovariance centre_T_base{keyframe.centre_T_base(),
                                                  keyframe.members.front().covariance};
  const geometry::SE2WithCovariance base_T_centre = inverse(centre_T_base);
  const NodeIndex node = add_node(base_T_centre.mean, keyframe);
  smoother_.add(
      factor_graph::plane::PosePrior{nodes_[node].centre, base_T_centre.mean, kTiny.inverse()});
  add_base({node, keyframe.sequence, keyframe.utime, centre_T_base, middle_of(keyframe), true});
  if (const auto& level = level_.latest()) {
    const Eigen::Rotation2D<double> quarter(-0.5 * std::numbers::pi);
    const Eigen::Matrix2d arm = kLandmarkHeight_m * quarter.toRotationMatrix();
    start_covariance_m2_ = arm * level->covariance * arm.transpose();
  }
  ++keyframes_;
  discover(keyframe, node, update);
  const factor_graph::plane::SmootherUpdate solved = smoother_.update();
  if (!solved.ok) update.reason = solved.error;
  adopt_estimates();
  finish(keyframe, update);
  update.status = model::MapUpdateStatus::kFirstMap;
}

geometry::SE2WithCovariance SmoothingMapper::base_pose(const Base& base) const {
  if (base.is_origin) return {};
  const factor_graph::plane::PoseId centre = nodes_[base.node].centre;
  return compound({smoother_.pose(centre), Eigen::Matrix3d::Zero()}, base.centre_T_base);
}

geometry::SE2 SmoothingMapper::middle_pose(const Base& base) const {
  return smoother_.pose(nodes_[base.node].centre) * base.centre_T_middle;
}

geometry::SE2 middle_of(const model::Keyframe& keyframe) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const geometry::SE2 base_T_centre = keyframe.centre_T_base().inverse();
  for (const model::KeyframeMember& member : keyframe.members)
    sum += (base_T_centre * member.centre_T_vehicle).coordinates();
  sum /= static_cast<double>(keyframe.members.size());
  return keyframe.centre_T_base() * geometry::SE2(sum.x(), sum.y(), sum.z());
}

/// Covariance (right perturbation) of what the graph cannot know, since all that is seen shares it:
/// how wrongly the first keyframe was levelled, and the scale of distances.
Eigen::Matrix3d SmoothingMapper::shared_error(const geometry::SE2& map_T_vehicle) const {
  const Eigen::Matrix2d back = map_T_vehicle.rotation().transpose();
  const Eigen::Vector2d off = parameters_.scale_sigma * (back * map_T_vehicle.translation());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  covariance.topLeftCorner<2, 2>() =
      back * start_covariance_m2_ * back.transpose() + off * off.transpose();
  return covariance;
}

/// What every accepted keyframe leaves behind. Its base is bases_.back().
void SmoothingMapper::finish(const model::Keyframe& keyframe, model::MapUpdate& update) {
  const Base& base = bases_.back();
  const factor_graph::plane::PoseId centre = nodes_[base.node].centre;
  geometry::SE2WithCovariance map_T_centre{smoother_.pose(centre), Eigen::Matrix3d::Zero()};
  const auto marginal = smoother_.joint_marginal({&centre, 1}, {});
  if (marginal) map_T_centre.covariance = *marginal;
  if (bases_.front().is_origin) {
    const geometry::SE2WithCovariance origin_T_first = inverse(bases_.front().centre_T_base);
    map_T_centre = compound(origin_T_first, {origin_T_first.mean.inverse() * map_T_centre.mean,
                                             map_T_centre.covariance});
  }
  geometry::SE2WithCovariance map_T_base =
      base.is_origin ? geometry::SE2WithCovariance{} : compound(map_T_centre, base.centre_T_base);
  if (!base.is_origin) map_T_base.covariance += shared_error(map_T_base.mean);
  update.map_T_vehicle = map_T_base.mean;
  update.covariance = map_T_base.covariance;
  const model::KeyframeMember& last = keyframe.members.back();
  last_member_ = last_of(keyframe, base);
  update.map_T_latest_vehicle = map_T_centre.mean * last_member_->centre_T_vehicle.mean;
  map_T_last_base_ = map_T_base;
  odometry_.forget_before(last.utime);
  // The newest scan's place is now known better than it was when it came.
  if (!located_ || located_->utime <= last.utime) {
    located_ = LocatedScan{last.utime, update.map_T_latest_vehicle,
                           located_ ? located_->step : geometry::SE2(), last.covariance};
  }
}

std::vector<model::KeyframePose> SmoothingMapper::trajectory() const {
  std::vector<model::KeyframePose> result;
  result.reserve(bases_.size());
  for (const Base& base : bases_) {
    result.push_back({base.sequence, base.utime, base_pose(base).mean, Eigen::Matrix3d::Zero()});
  }
  return result;
}

model::MapLandmark SmoothingMapper::to_map_landmark(const StoredLandmark& landmark) const {
  model::MapLandmark out;
  out.id = landmark.id;
  out.position_m = landmark.point ? smoother_.point(*landmark.point) : landmark.position_m;
  out.radius_m = landmark.radius_m;
  out.observation_count = landmark.observation_count;
  out.kind = landmark.kind;
  return out;
}

std::vector<model::MapLandmark> SmoothingMapper::landmarks() const {
  std::vector<model::MapLandmark> result;
  result.reserve(store_.all().size());
  for (const auto& [id, landmark] : store_.all()) result.push_back(to_map_landmark(landmark));
  return result;
}

std::optional<std::vector<model::MapLandmark>> SmoothingMapper::take_changed_landmarks() {
  std::sort(changed_.begin(), changed_.end());
  changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
  std::vector<model::MapLandmark> result;
  for (const model::LandmarkId id : changed_) {
    const auto found = store_.all().find(id);
    if (found != store_.all().end()) result.push_back(to_map_landmark(found->second));
  }
  changed_.clear();
  return result;
}

}  // namespace understory::geoslam_mapper::smoothing
