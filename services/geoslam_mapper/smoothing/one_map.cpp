#include "services/geoslam_mapper/smoothing/one_map.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "services/geoslam_mapper/smoothing/absorbed_map.hpp"
#include "services/geoslam_mapper/smoothing/filter_gate.hpp"
#include "services/geoslam_mapper/smoothing/gone_landmarks.hpp"
#include "services/geoslam_mapper/smoothing/unseen.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Fewest landmarks to start a map without odometry.
constexpr std::size_t kMinToStart = 3;
/// Number of landmarks in common with the map at which a keyframe agrees with it: two determine a
/// pose.
constexpr std::uint32_t kInCommon = 2;

model::MapUpdate with(model::MapUpdateStatus status, std::string reason, model::MapUpdate update) {
  update.status = status;
  if (!reason.empty()) update.reason = std::move(reason);
  return update;
}

std::vector<model::LandmarkId> ids_of(std::span<const model::Association> pairs) {
  std::vector<model::LandmarkId> ids;
  ids.reserve(pairs.size());
  for (const model::Association& pair : pairs) ids.push_back(pair.landmark_id);
  return ids;
}

/// Adds sightings of landmarks out of use, in order of the keyframe's landmarks.
void add_gone(std::span<const model::Association> gone, model::MapUpdate& update) {
  if (gone.empty()) return;
  update.associations.insert(update.associations.end(), gone.begin(), gone.end());
  std::ranges::stable_sort(update.associations, {}, &model::Association::keyframe_landmark);
}

/// All bases are tied to one node: the graph is not solved any more, so the bases do not move.
void keep_pose(const model::Keyframe& keyframe, const Placement& placement, GlobalMap& map) {
  if (!map.graph.newest()) map.graph.add_node({}, false);
  const NodeIndex node = *map.graph.newest();
  geometry::SE2WithCovariance node_T_centre = placement.map_T_centre;
  node_T_centre.mean = map.graph.pose(node).inverse() * node_T_centre.mean;

  Base base = base_of(keyframe, node);
  base.centre_T_base = compound(node_T_centre, base.centre_T_base);
  base.centre_T_middle = node_T_centre.mean * base.centre_T_middle;
  map.trajectory.add_spare(base);
}

}  // namespace

OneMap::OneMap(const SmoothingMapperParameters& parameters, std::uint32_t id)
    : parameters_(parameters),
      place_recogniser_(parameters),
      map_(parameters, id),
      motion_(parameters),
      discovery_(parameters),
      merging_(parameters),
      known_ground_(parameters),
      condensing_(parameters),
      dormancy_(parameters),
      submaps_(parameters),
      scan_localiser_(parameters),
      common_error_(parameters.scale_sigma),
      range_scale_(parameters.scale_sigma, parameters.odometry_scale_sigma) {}

OneMap OneMap::beside(std::uint32_t id) const {
  OneMap other(parameters_, id);
  other.motion_ = motion_.from_nowhere();
  if (condensing_.keeps_stretches()) other.keep_stretches();
  if (const auto& level = scan_localiser_.level()) other.scan_localiser_.set(*level);
  other.sweep_level_ = sweep_level_;
  other.range_scale_ = range_scale_.beside();
  return other;
}

void OneMap::add(const model::Odometry& odometry) {
  model::Odometry in_map_units = odometry;
  in_map_units.from_T_to =
      geometry::SE2(range_scale_.odometry_factor() * odometry.from_T_to.translation(),
                    odometry.from_T_to.theta());
  motion_.add(in_map_units);
  sweep_level_.add(odometry);
}

model::MapUpdate OneMap::add(const model::Keyframe& keyframe) {
  using enum model::MapUpdateStatus;
  model::MapUpdate update;
  update.keyframe_sequence = keyframe.sequence;
  update.utime = keyframe.utime;
  update.map_id = map_.landmarks.map_id();

  if (map_.empty()) {
    if (auto reason = why_not_start(keyframe); !reason.empty())
      return with(kNotSure, reason, std::move(update));
    start_map(keyframe, update);
    agreeing_ = 1;
    return with(kFirstMap, {}, std::move(update));
  }

  level_start();

  // Localises the keyframe.
  const auto prediction = motion_.predict(keyframe, map_.graph);
  if (prediction)
    dormancy_.prepare(keyframe.field_of_view, prediction->map_T_centre.mean.translation(), map_);
  const auto placement = place(keyframe, prediction, update);
  if (!placement) {
    if (prediction) motion_.assume(keyframe, *prediction);
    return with(kNotSure, {}, std::move(update));
  }
  update.used_prior = placement->by_prediction;
  update.inliers = static_cast<std::uint32_t>(placement->associations.size());
  update.associations = placement->associations;

  // In localisation-only mode the map does not change.
  if (parameters_.localisation_only) {
    add_gone(name_gone(keyframe, placement->map_T_centre.mean, update.associations, parameters_,
                       map_.landmarks),
             update);
    keep_pose(keyframe, *placement, map_);
    report(keyframe, update);
    return with(kUpdated, {}, std::move(update));
  }

  // Fuses the keyframe.
  map_.wake(ids_of(placement->associations));
  Condensing::Due due = condensing_.due(keyframe.field_of_view.max_range_m, known_ground_, map_);
  const FusedKeyframe fused = fuse(keyframe, *placement, motion_, parameters_, due.nodes, map_);
  update.associations = fused.associations;
  update.chi2 = fused.chi2;
  update.degrees_of_freedom = fused.degrees_of_freedom;
  if (!fused.ok) return with(kRolledBack, fused.reason, std::move(update));
  compare_scales(keyframe, fused.associations);
  condensing_.follow(fused, std::move(due), discovery_, merging_.merges(), map_);
  closures_.hand_over(fused.condensed);
  if (!fused.condensed.empty()) submaps_.condensed(fused.condensed.front().into);
  closures_.hand_over(known_ground_.follow(fused, discovery_, merging_.merges(), map_));
  const std::vector<model::Association> gone = name_gone(
      fused.keyframe, map_.graph.pose(fused.node), fused.associations, parameters_, map_.landmarks);
  extend(fused, gone, update);
  if (fused.condensed.empty())
    condensing_.compute_ahead(keyframe.field_of_view.max_range_m, known_ground_, map_);
  lighten(keyframe, fused.node, !fused.condensed.empty());
  confirm(keyframe, update);
  report(keyframe, update);
  return with(kUpdated, fused.reason, std::move(update));
}

/// Removes distant parts from the solved graph. Condensing and dormancy each change much of the
/// graph, which adds to the next keyframe's solution, and submaps take time of their own: at most
/// one of them runs per keyframe. Deferred ones run first at the next keyframe.
void OneMap::lighten(const model::Keyframe& keyframe, NodeIndex newest, bool has_condensed) {
  const bool may_wait = has_condensed && !lightening_.has_waited;
  lightening_.has_waited = may_wait;
  if (may_wait) return;

  const auto give_away = [&] {
    return submaps_.follow(keyframe.field_of_view, newest, keyframe.utime, map_);
  };
  if (lightening_.submaps_first && give_away()) {
    lightening_.submaps_first = false;
  } else if (dormancy_.follow(keyframe.field_of_view, newest, map_)) {
    lightening_.submaps_first = true;
  } else if (!lightening_.submaps_first) {
    (void)give_away();
  }
}

/// Without the gyro's bias the first scan's heading is inaccurate, and it would be the map's
/// heading. The map waits for it for at most `start_wait_s`.
std::string OneMap::why_not_start(const model::Keyframe& keyframe) {
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
/// uncertainty of this fixed pose is added to the reported covariances. As a prior in the graph it
/// would hold the map's heading to 3 mrad only, and linearisation errors would rotate the map.
void OneMap::start_map(const model::Keyframe& keyframe, model::MapUpdate& update) {
  const NodeIndex node = map_.graph.add_node(keyframe.centre_T_base().inverse(),
                                             map_.trajectory.is_stationary(keyframe), true);
  map_.trajectory.add(base_of(keyframe, node, true), map_.graph);
  start_level_.begin(keyframe.utime, scan_localiser_.level());
  common_error_.set_start_level(start_level_.covariance());

  for (const model::Association& pair : discovery_.update(keyframe, node, {}, map_)) {
    update.associations.push_back(pair);
    update.added.push_back(pair.landmark_id);
  }

  const factor_graph::plane::SmootherUpdate solved = map_.graph.solve();
  if (!solved.ok) update.reason = solved.error;
  map_.adopt_estimates();
  report(keyframe, update);
}

/// Applies a later estimate of the level at the map's origin to the whole map: the landmarks move,
/// the vehicle's pose at the start does not.
void OneMap::level_start() {
  const auto found = start_level_.take();
  if (!found) return;
  const Eigen::Vector2d moved_m = -CommonError::displacement_m(found->error_rad);
  map_.graph.checkpoint();
  if (!map_.graph.move_origin(moved_m)) return;
  (void)map_.graph.solve();  // All landmarks move alike.
  map_.trajectory.keep_in_place(found->until, -moved_m, map_.graph);
  map_.adopt_estimates();
  common_error_.set_start_level(start_level_.covariance());
}

/// Compares the keyframe's motion by landmarks alone with odometry, to estimate their scales.
void OneMap::compare_scales(const model::Keyframe& keyframe,
                            std::span<const model::Association> associations) {
  std::vector<Eigen::Vector2d> positions_m;
  positions_m.reserve(associations.size());
  for (const model::Association& pair : associations)
    positions_m.push_back(map_.landmarks.at(pair.landmark_id).position_m);
  const auto located = located_by_landmarks(keyframe, associations, positions_m);
  if (!located) return;

  std::optional<geometry::SE2WithCovariance> odometry;
  if (const auto& last = range_scale_.last()) {
    odometry = motion_.between(last->utime, located->utime);
    if (odometry) {
      const geometry::SE2& motion = odometry->mean;
      odometry->mean =
          geometry::SE2(motion.translation() / range_scale_.odometry_factor(), motion.theta());
    }
  }
  range_scale_.add(*located, odometry);
  common_error_.set_scale_sigma(range_scale_.sigma());
}

/// Searches around the prediction; if few landmarks match there, in the whole map. If that finds no
/// place either, the prediction is used while odometry is accurate enough: the landmarks are
/// mapped, and the next keyframe can match them.
std::optional<Placement> OneMap::place(const model::Keyframe& keyframe,
                                       const std::optional<Prediction>& prediction,
                                       model::MapUpdate& update) {
  std::optional<Tracking> tracked;
  if (prediction) tracked = place_recogniser_.track(keyframe, *prediction, map_);
  std::optional<Placement> placement;
  if (tracked && tracked->is_confirmed) placement = std::move(tracked->placement);
  if (!placement) {
    map_.landmarks.catch_up();
    SearchResult searched = place_recogniser_.search(keyframe, map_);
    update.candidates = searched.hypotheses;
    update.log10_false_alarm = searched.log10_false_alarm;
    update.reason = std::move(searched.reason);
    placement = std::move(searched.placement);
    if (placement) update.reason.clear();
    if (!placement && tracked && reaches(*prediction)) {
      placement = std::move(tracked->placement);
      update.reason = "few landmarks match where odometry places it: " + update.reason;
    }
  }
  if (placement) map_.landmarks.set_loose(placement->loose);

  if (placement && contradicts_filter(keyframe, *placement, motion_.filter(), map_,
                                      parameters_.filter_disagreement_m)) {
    update.reason = "few landmarks, and their motion contradicts the filter's";
    return std::nullopt;
  }
  return placement;
}

/// Adds new landmarks of a fused keyframe, and merges or separates landmarks. `gone`: sightings of
/// landmarks out of use; they do not become new landmarks.
void OneMap::extend(const FusedKeyframe& fused, std::span<const model::Association> gone,
                    model::MapUpdate& update) {
  std::vector<model::Association> known = fused.associations;
  known.insert(known.end(), gone.begin(), gone.end());
  for (const model::Association& pair :
       discovery_.update(fused.keyframe, fused.node, known, map_)) {
    update.associations.push_back(pair);
    update.added.push_back(pair.landmark_id);
  }
  MergingResult merging = merging_.follow(fused, update.associations, map_);
  update.merged = std::move(merging.merged);
  if (merging.separated) update.added.push_back(*merging.separated);
  add_gone(gone, update);
}

/// Reports the pose of an accepted keyframe; motion and single scans continue from it.
void OneMap::report(const model::Keyframe& keyframe, model::MapUpdate& update) {
  const Base& base = map_.trajectory.last();
  const auto map_T_centre = map_.trajectory.centre_from_origin(base.node, map_.graph);
  geometry::SE2WithCovariance map_T_base;
  if (!base.is_origin) {
    map_T_base = compound(map_T_centre, base.centre_T_base);
    map_T_base.covariance += common_error_.covariance_at(map_T_base.mean);
  }
  motion_.continue_from(keyframe, base, map_T_base);
  update.expected = expected_unseen(keyframe, map_T_base.mean * keyframe.centre_T_base().inverse(),
                                    update.associations, map_.landmarks);

  update.map_T_vehicle = map_T_base.mean;
  update.covariance = map_T_base.covariance + sweep_level_.pose_covariance();
  update.map_T_latest_vehicle = map_T_centre.mean * motion_.centre_T_last_member()->mean;

  const model::KeyframeMember& last = keyframe.members.back();
  scan_localiser_.restart_at(last.utime, {update.map_T_latest_vehicle, last.covariance}, map_T_base,
                             sweep_level_.pose_covariance());
}

std::optional<ScanPose> OneMap::locate(const model::LandmarkScan& scan) {
  return scan_localiser_.locate(scan, map_.landmarks, motion_, sweep_level_.pose_covariance());
}

Closures::Decision OneMap::take(const model::LoopClosure& closure) {
  if (closure.is_revoked) return closures_.revoke(closure.id, map_);
  const auto from = end_of(closure.from);
  const auto to = end_of(closure.to);
  if (!from || !to) {
    const model::LoopEnd& missing = from ? closure.to : closure.from;
    const std::string what = missing.submap != 0 ? "submap " + std::to_string(missing.submap)
                                                 : "keyframe " + std::to_string(missing.keyframe);
    return {model::LoopResult::Status::kRefused, what + " is not in the graph"};
  }

  // The closure may move all nodes between its ends, and needs covariances across the whole map.
  map_.unfreeze();
  return closures_.take(closure, *from, *to, map_);
}

std::optional<ClosureEnd> OneMap::end_of(const model::LoopEnd& end) const {
  if (end.submap != 0) {
    const auto node = submaps_.node_of(end.submap);
    if (!node) return std::nullopt;
    return ClosureEnd{*node, {}};
  }
  const auto bases = map_.trajectory.bases();
  const auto base = std::ranges::find(bases, end.keyframe, &Base::sequence);
  if (base == bases.end()) return std::nullopt;
  return ClosureEnd{base->node, base->centre_T_base};
}

bool OneMap::rejoin(GlobalMap left, const Overlap& overlap, model::MapUpdate& update) {
  std::vector<model::LandmarkId> added = absorb(std::move(left), overlap.map_T_left, map_);
  const auto is_there = [&](model::LandmarkId id) { return map_.landmarks.all().contains(id); };
  std::vector<MergedPair> pairs;
  for (const auto& [ours, theirs] : overlap.pairs) {
    if (is_there(ours) && is_there(theirs))
      pairs.push_back(Merges::in_order(ours, theirs, map_.landmarks));
  }
  pairs = merging_.join(std::move(pairs), map_);
  if (pairs.empty()) return false;

  // The common landmarks tie the two maps now.
  map_.graph.checkpoint();
  map_.graph.take_closure_out(kAbsorbing);
  if (!map_.graph.solve().ok) return false;
  map_.adopt_estimates();

  std::ranges::move(added, std::back_inserter(update.added));
  std::ranges::move(pairs, std::back_inserter(update.merged));
  update.reason = "map " + std::to_string(overlap.map_id) + " is part of this one";
  return true;
}

void OneMap::take(const model::Existence& existence) {
  for (const model::LandmarkExistence& one : existence.landmarks)
    map_.landmarks.set_in_use(one.id, one.is_in_use);
}

bool OneMap::reaches(const model::Keyframe& keyframe) const {
  const auto prediction = motion_.predict(keyframe, map_.graph);
  return prediction && reaches(*prediction);
}

bool OneMap::reaches(const Prediction& prediction) const {
  if (!prediction.from_odometry) return false;
  const Eigen::Matrix3d& covariance = prediction.map_T_centre.covariance;
  return std::sqrt(covariance.topLeftCorner<2, 2>().trace()) <= parameters_.lost_sigma_m &&
         std::sqrt(covariance(2, 2)) <= parameters_.lost_sigma_rad;
}

bool OneMap::is_provisional() const {
  return agreeing_ < static_cast<std::uint32_t>(parameters_.new_map_keyframes);
}

void OneMap::start_with(std::span<const model::MapLandmark> landmarks) {
  for (const model::MapLandmark& given : landmarks)
    map_.landmarks.add_given(given, parameters_.given_map_sigma_m);
  range_scale_.hold();
  agreeing_ = static_cast<std::uint32_t>(parameters_.new_map_keyframes);
}

/// Removes landmarks that only the first keyframe observed, once there are enough other keyframes.
void OneMap::confirm(const model::Keyframe& keyframe, model::MapUpdate& update) {
  const bool was_provisional = is_provisional();
  if (update.inliers >= kInCommon) ++agreeing_;
  if (was_provisional && !is_provisional())
    update.removed = drop_unseen(keyframe.field_of_view, map_);
}

std::vector<model::MapLandmark> OneMap::take_changed_landmarks(double around_m) {
  std::vector<model::LandmarkId> ids = map_.landmarks.take_changed();
  if (const auto& base = map_T_last_base()) {
    map_.landmarks.index().for_each_within(
        base->mean.translation(), around_m,
        [&](model::LandmarkId id, const Eigen::Vector2d&, double) { ids.push_back(id); });
    std::ranges::sort(ids);
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  }

  std::vector<model::MapLandmark> result;
  result.reserve(ids.size());
  for (const model::LandmarkId id : ids) result.push_back(map_.landmark(map_.landmarks.at(id)));
  return result;
}

}  // namespace understory::geoslam_mapper::smoothing
