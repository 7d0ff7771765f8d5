#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <stdexcept>

#include "services/geoslam_mapper/smoothing/doubles.hpp"
#include "services/geoslam_mapper/smoothing/filter_gate.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

constexpr state::Format kFormat{"geoslam_mapper.smoothing", 6};
/// Fewest landmarks that start a map without odometry.
constexpr std::size_t kMinToStart = 3;

bool is_finite(const model::Keyframe& keyframe) {
  const auto is_good = [](const model::KeyframeLandmark& l) {
    return l.position_m.allFinite() && l.covariance_m2.allFinite() &&
           l.covariance_m2.determinant() > 0.0 && l.covariance_m2.trace() > 0.0;
  };
  const auto is_good_member = [](const model::KeyframeMember& m) {
    return m.centre_T_vehicle.coordinates().allFinite() && m.covariance.allFinite();
  };
  return std::all_of(keyframe.landmarks.begin(), keyframe.landmarks.end(), is_good) &&
         std::all_of(keyframe.members.begin(), keyframe.members.end(), is_good_member);
}

model::MapUpdate with(model::MapUpdateStatus status, std::string reason, model::MapUpdate update) {
  update.status = status;
  if (!reason.empty()) update.reason = std::move(reason);
  return update;
}

}  // namespace

SmoothingMapper::SmoothingMapper(const SmoothingMapperParameters& parameters)
    : parameters_(parameters),
      place_recogniser_(parameters),
      map_(parameters),
      motion_(parameters),
      discovery_(parameters),
      known_ground_(parameters),
      scan_localiser_(parameters),
      common_error_(parameters.scale_sigma) {}

std::unique_ptr<MapperMethod> make_smoothing_mapper(const SmoothingMapperParameters& parameters) {
  return std::make_unique<SmoothingMapper>(parameters);
}

model::MapUpdate SmoothingMapper::add(const model::Keyframe& keyframe) {
  using enum model::MapUpdateStatus;
  model::MapUpdate update;
  update.keyframe_sequence = keyframe.sequence;
  update.utime = keyframe.utime;

  // A keyframe that can be used, and a map.
  if (auto reason = malformed(keyframe); !reason.empty())
    return with(kRejected, reason, std::move(update));
  last_utime_ = keyframe.utime;
  if (map_.empty()) {
    if (auto reason = why_not_start(keyframe); !reason.empty())
      return with(kNotSure, reason, std::move(update));
    start_map(keyframe, update);
    return with(kFirstMap, {}, std::move(update));
  }

  // Where is it?
  const auto prediction = motion_.predict(keyframe, map_.graph);
  const auto placement = place(keyframe, prediction, update);
  if (!placement) {
    if (prediction) motion_.assume(keyframe, *prediction);
    return with(kNotSure, {}, std::move(update));
  }
  update.used_prior = placement->by_prediction;
  update.inliers = static_cast<std::uint32_t>(placement->associations.size());
  update.associations = placement->associations;

  // A given map stays as it is.
  if (parameters_.localisation_only) {
    keep_pose(keyframe, *placement);
    report(keyframe, update);
    return with(kUpdated, {}, std::move(update));
  }

  // What does it add?
  const FusedKeyframe fused = fuse(keyframe, *placement, motion_, parameters_, map_);
  update.associations = fused.associations;
  update.chi2 = fused.chi2;
  update.degrees_of_freedom = fused.degrees_of_freedom;
  if (!fused.ok) return with(kRolledBack, fused.reason, std::move(update));
  known_ground_.follow(fused, discovery_, map_);
  extend(fused, update);
  report(keyframe, update);
  return with(kUpdated, fused.reason, std::move(update));
}

std::string SmoothingMapper::malformed(const model::Keyframe& keyframe) const {
  if (keyframe.members.empty()) return "keyframe without members";
  if (last_utime_ && keyframe.utime <= *last_utime_) return "keyframe not later than the last one";
  if (!is_finite(keyframe))
    return "keyframe with a value that is not finite or a covariance that is not positive";
  return {};
}

/// While the gyro's bias is unknown the first scan's heading is, too, and it would be the map's.
/// But the map does not wait for it longer than `start_wait_s`.
std::string SmoothingMapper::why_not_start(const model::Keyframe& keyframe) {
  if (parameters_.localisation_only) return "localisation only, but no map was given";
  if (!parameters_.use_odometry) {
    return keyframe.landmarks.size() < kMinToStart ? "too few landmarks to start a map" : "";
  }
  if (!first_offered_) first_offered_ = keyframe.utime;
  const double waited_s = 1e-6 * static_cast<double>(keyframe.utime - *first_offered_);
  if (waited_s >= parameters_.start_wait_s || motion_.knows_heading(keyframe)) return {};
  return "the gyro's bias is not known yet";
}

/// The first keyframe's base is the origin of the map; its centre is fixed relative to it. The
/// uncertainty of that is added where covariances are reported. As a prior in the graph it would
/// hold the map by 3 mrad only, and the residues of linearisation would rotate the map.
void SmoothingMapper::start_map(const model::Keyframe& keyframe, model::MapUpdate& update) {
  const NodeIndex node = map_.graph.add_node(keyframe.centre_T_base().inverse(),
                                             map_.trajectory.is_stationary(keyframe), true);
  map_.trajectory.add(base_of(keyframe, node, true), map_.graph);
  if (const auto& level = scan_localiser_.level()) common_error_.set_start_level(*level);

  for (const model::Association& pair : discovery_.update(keyframe, node, {}, map_)) {
    update.associations.push_back(pair);
    update.added.push_back(pair.landmark_id);
  }

  const factor_graph::plane::SmootherUpdate solved = map_.graph.solve();
  if (!solved.ok) update.reason = solved.error;
  map_.adopt_estimates();
  report(keyframe, update);
}

/// Around the prediction; where nothing fits there, in the whole map.
std::optional<Placement> SmoothingMapper::place(const model::Keyframe& keyframe,
                                                const std::optional<Prediction>& prediction,
                                                model::MapUpdate& update) {
  std::optional<Placement> placement;
  if (prediction) placement = place_recogniser_.track(keyframe, *prediction, map_);
  if (!placement) {
    map_.landmarks.catch_up();
    SearchResult searched = place_recogniser_.search(keyframe, map_);
    update.candidates = searched.hypotheses;
    update.log10_false_alarm = searched.log10_false_alarm;
    update.reason = std::move(searched.reason);
    placement = std::move(searched.placement);
  }

  if (placement && contradicts_filter(keyframe, *placement, motion_.filter(), map_,
                                      parameters_.filter_disagreement_m)) {
    update.reason = "few landmarks, and their motion contradicts the filter's";
    return std::nullopt;
  }
  return placement;
}

/// All bases are tied to one node: the graph is not solved any more, so nothing moves it.
void SmoothingMapper::keep_pose(const model::Keyframe& keyframe, const Placement& placement) {
  if (!map_.graph.newest()) map_.graph.add_node({}, false);
  const NodeIndex node = *map_.graph.newest();
  geometry::SE2WithCovariance node_T_centre = placement.map_T_centre;
  node_T_centre.mean = map_.graph.pose(node).inverse() * node_T_centre.mean;

  Base base = base_of(keyframe, node);
  base.centre_T_base = compound(node_T_centre, base.centre_T_base);
  base.centre_T_middle = node_T_centre.mean * base.centre_T_middle;
  map_.trajectory.add_spare(base);
}

/// New landmarks of a fused keyframe, and landmarks that are merged.
void SmoothingMapper::extend(const FusedKeyframe& fused, model::MapUpdate& update) {
  for (const model::Association& pair :
       discovery_.update(fused.keyframe, fused.node, fused.associations, map_)) {
    update.associations.push_back(pair);
    update.added.push_back(pair.landmark_id);
  }
  update.merged = merge_doubles(update.associations, parameters_, map_);
}

/// The pose of an accepted keyframe; motion and single scans go on from there.
void SmoothingMapper::report(const model::Keyframe& keyframe, model::MapUpdate& update) {
  const Base& base = map_.trajectory.last();
  const auto map_T_centre = map_.trajectory.centre_from_origin(base.node, map_.graph);
  geometry::SE2WithCovariance map_T_base;
  if (!base.is_origin) {
    map_T_base = compound(map_T_centre, base.centre_T_base);
    map_T_base.covariance += common_error_.covariance_at(map_T_base.mean);
  }
  motion_.continue_from(keyframe, base, map_T_base);

  update.map_T_vehicle = map_T_base.mean;
  update.covariance = map_T_base.covariance;
  update.map_T_latest_vehicle = map_T_centre.mean * motion_.centre_T_last_member()->mean;

  const model::KeyframeMember& last = keyframe.members.back();
  scan_localiser_.restart_at(last.utime, update.map_T_latest_vehicle, last.covariance);
}

std::optional<geometry::SE2WithCovariance> SmoothingMapper::locate(
    const model::LandmarkScan& scan) {
  return scan_localiser_.locate(scan, map_.landmarks, motion_);
}

void SmoothingMapper::start_with(std::span<const model::MapLandmark> landmarks) {
  for (const model::MapLandmark& given : landmarks)
    map_.landmarks.add_given(given, parameters_.given_map_sigma_m);
}

std::vector<model::KeyframePose> SmoothingMapper::trajectory() const {
  std::vector<model::KeyframePose> result;
  result.reserve(map_.trajectory.size());
  for (const Base& base : map_.trajectory.bases()) {
    result.push_back({base.sequence, base.utime, map_.trajectory.pose(base, map_.graph),
                      Eigen::Matrix3d::Zero()});
  }
  return result;
}

std::vector<model::MapLandmark> SmoothingMapper::landmarks() const {
  std::vector<model::MapLandmark> result;
  result.reserve(map_.landmarks.all().size());
  for (const auto& [id, landmark] : map_.landmarks.all()) result.push_back(map_.landmark(landmark));
  return result;
}

std::optional<std::vector<model::MapLandmark>> SmoothingMapper::take_changed_landmarks() {
  std::vector<model::MapLandmark> result;
  for (const model::LandmarkId id : map_.landmarks.take_changed())
    result.push_back(map_.landmark(map_.landmarks.at(id)));
  return result;
}

std::string SmoothingMapper::save() const { return state::save(kFormat, *this); }

void SmoothingMapper::load(const std::string& state) {
  SmoothingMapper loaded(parameters_);
  try {
    state::load(state, kFormat, loaded);
  } catch (const std::out_of_range& error) {
    throw std::invalid_argument(std::string("mapper state: ") + error.what());
  }
  *this = std::move(loaded);
}

}  // namespace understory::geoslam_mapper::smoothing
