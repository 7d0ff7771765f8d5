#include "services/geoslam_mapper/smoothing/place_recogniser.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "common/factor_graph/plane/graph.hpp"
#include "common/geometry/registration.hpp"

namespace understory::geoslam_mapper::smoothing {

namespace plane = factor_graph::plane;

namespace {

/// Margin beyond the field of view, so that landmarks at its edge are found despite the pose's
/// error.
constexpr double kViewMargin_m = 5.0;

double plane_variance(const model::KeyframeLandmark& landmark) {
  return 0.5 * landmark.covariance_m2.trace();
}

std::vector<model::LandmarkId> landmarks_in_view(const model::Keyframe& keyframe,
                                                 const geometry::SE2WithCovariance& guess,
                                                 const LandmarkMap& landmarks) {
  double reach = 0.0;
  for (const model::KeyframeLandmark& landmark : keyframe.landmarks)
    reach = std::max(reach, landmark.position_m.norm());
  const double spread = std::sqrt(guess.covariance.topLeftCorner<2, 2>().trace());
  return landmarks.index().near({guess.mean.translation(), reach + kViewMargin_m + 3.0 * spread});
}

/// Up to this size [m] gates are unambiguous, also towards landmarks that the map does not contain.
constexpr double kNarrow_m = 0.3;
/// Likewise for landmarks of a given map before this drive observed them: most of their covariance
/// is common to all around, and the vehicle was localised among these.
constexpr double kNarrowGiven_m = 1.0;

/// Whether a landmark that does not share the reference's error has so wide a gate that it is
/// ambiguous. All landmarks of a pass are displaced together then.
bool is_loose(const StoredLandmark& landmark, double gate_m,
              const std::optional<Reference>& reference, int recent_keyframes,
              const Trajectory& trajectory) {
  const double narrow_m = landmark.nodes.empty() ? kNarrowGiven_m : kNarrow_m;
  return gate_m > narrow_m &&
         !(reference && is_recent(landmark, *reference, recent_keyframes, trajectory));
}

/// Pose of the vehicle in the map's frame at the last keyframe. If the graph is not solved
/// (localisation only), odometry's prediction is used; a prediction by the keyframer's track has
/// assumed noise and counts as exact.
geometry::SE2WithCovariance vehicle_in_map(const Prediction& prediction, const GlobalMap& map) {
  if (!map.trajectory.bases().empty()) {
    geometry::SE2WithCovariance last = map.graph.marginal(map.trajectory.last().node);
    if (!last.covariance.isZero(0.0)) return last;
  }
  if (prediction.from_odometry) return prediction.map_T_centre;
  return {prediction.map_T_centre.mean, Eigen::Matrix3d::Zero()};
}

/// Variance of a map position relative to the vehicle that follows from the vehicle's pose, per
/// axis [m^2].
double variance_from(const geometry::SE2WithCovariance& map_T_vehicle,
                     const Eigen::Vector2d& place_m) {
  const Eigen::Matrix<double, 2, 3> j = plane::linearise(map_T_vehicle.mean, place_m).pose;
  return 0.5 * (j * map_T_vehicle.covariance * j.transpose()).trace();
}

/// The last keyframe as reference; none if the map has none.
std::optional<Reference> last_keyframe(const GlobalMap& map) {
  if (map.trajectory.bases().empty()) return std::nullopt;
  return Reference{map.trajectory.last().node, map.trajectory.size()};
}

/// The node that observed the landmarks of the pose found: the middle one of those in the graph, in
/// order of their last observation.
std::optional<Reference> seen_from(std::span<const constellation::PointAssociation> found,
                                   const GlobalMap& map) {
  std::vector<const StoredLandmark*> seen;
  for (const constellation::PointAssociation& one : found) {
    const StoredLandmark& landmark = map.landmarks.at(one.landmark_id);
    if (!landmark.nodes.empty() && map.graph.position(landmark.id)) seen.push_back(&landmark);
  }
  if (seen.empty()) return last_keyframe(map);
  const auto middle = seen.begin() + static_cast<std::ptrdiff_t>(seen.size() / 2);
  std::nth_element(seen.begin(), middle, seen.end(), [](const auto* a, const auto* b) {
    return std::pair(a->last_keyframe, a->id) < std::pair(b->last_keyframe, b->id);
  });
  return Reference{(*middle)->nodes.back(), (*middle)->last_keyframe};
}

/// Number of the keyframe's landmarks that could be matched: at most the number of map landmarks in
/// the field of view, without ambiguous ones.
std::size_t count_matchable(const model::Keyframe& keyframe, const geometry::SE2& map_T_centre,
                            const std::vector<model::LandmarkId>& loose,
                            const LandmarkMap& landmarks) {
  std::size_t in_view = 0;
  const geometry::SE2 vehicle_T_map = (map_T_centre * keyframe.centre_T_base()).inverse();
  const double range = keyframe.field_of_view.max_range_m;
  landmarks.index().for_each_within(
      map_T_centre.translation(), range + kViewMargin_m,
      [&](model::LandmarkId id, const Eigen::Vector2d& position, double) {
        if (keyframe.field_of_view.contains(vehicle_T_map * position) &&
            !std::binary_search(loose.begin(), loose.end(), id)) {
          ++in_view;
        }
      });
  return std::min(in_view, keyframe.landmarks.size());
}

/// Covariance of a registration without the information of its guess; the guess's own if that
/// leaves none.
Eigen::Matrix3d without_guess(const Eigen::Matrix3d& registered, const Eigen::Matrix3d& guess) {
  const Eigen::Matrix3d left = registered.inverse() - guess.inverse();
  const Eigen::LLT<Eigen::Matrix3d> factor(left);
  if (factor.info() != Eigen::Success) return guess;
  return left.inverse();
}

}  // namespace

Placement PlaceRecogniser::associate(const model::Keyframe& keyframe,
                                     const geometry::SE2WithCovariance& guess,
                                     const std::optional<Reference>& relative_to,
                                     const std::optional<Prediction>& tracked,
                                     const GlobalMap& map) const {
  // The map's landmarks around the guess.
  std::vector<model::LandmarkId> ids = landmarks_in_view(keyframe, guess, map.landmarks);
  std::vector<double> variances =
      relative_variances(ids, relative_to, parameters_.recent_keyframes, map);
  std::vector<geometry::UncertainPoint> reference;
  std::vector<model::LandmarkId> loose;
  std::optional<geometry::SE2WithCovariance> vehicle;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const StoredLandmark& landmark = map.landmarks.at(ids[i]);
    const auto gate_m = [&](double variance_m2) {
      return parameters_.gate_sigmas * std::sqrt(variance_m2) + parameters_.gate_floor_m;
    };
    // A landmark of the given map that no keyframe observed has an error in the frame of the map,
    // as the vehicle's pose has.
    double of_vehicle_m2 = 0.0;
    if (tracked && landmark.is_given_unseen()) {
      if (!vehicle) vehicle = vehicle_in_map(*tracked, map);
      of_vehicle_m2 = variance_from(*vehicle, landmark.position_m);
      variances[i] += of_vehicle_m2;
    }
    if (gate_m(of_vehicle_m2) > kNarrow_m ||
        is_loose(landmark, gate_m(variances[i]), relative_to, parameters_.recent_keyframes,
                 map.trajectory)) {
      loose.push_back(ids[i]);
      continue;
    }
    ids[reference.size()] = ids[i];
    reference.push_back({landmark.position_m, variances[i]});
  }

  // The keyframe's landmarks.
  std::vector<geometry::UncertainPoint> observed;
  for (const model::KeyframeLandmark& landmark : keyframe.landmarks)
    observed.push_back({landmark.position_m, plane_variance(landmark)});

  // Registers the keyframe to the map.
  geometry::RegistrationParameters gating;
  gating.gate_sigmas = parameters_.gate_sigmas;
  gating.gate_floor_m = parameters_.gate_floor_m;
  const geometry::SE2WithCovariance broad{guess.mean,
                                          guess.covariance + 1e-8 * Eigen::Matrix3d::Identity()};
  const geometry::Registration found = register_points(reference, observed, broad, gating);

  // Keeps pairs of the same kind.
  Placement placement{
      {found.reference_T_observed, found.covariance}, {}, tracked.has_value(), std::move(loose)};
  for (const geometry::PointPair& pair : found.pairs) {
    const model::LandmarkId id = ids[pair.reference];
    if (keyframe.landmarks[pair.observed].kind != map.landmarks.at(id).kind) continue;
    placement.associations.push_back({pair.observed, id});
  }
  return placement;
}

Tracking PlaceRecogniser::track(const model::Keyframe& keyframe, const Prediction& prediction,
                                const GlobalMap& map) const {
  Placement placement =
      associate(keyframe, prediction.map_T_centre, last_keyframe(map), prediction, map);
  const std::size_t possible =
      count_matchable(keyframe, placement.map_T_centre.mean, placement.loose, map.landmarks);
  const std::size_t matched = placement.associations.size();
  const geometry::MatchQuota quota{static_cast<std::size_t>(parameters_.min_matched),
                                   parameters_.min_matched_ratio};

  // With almost no landmarks to match, odometry alone is sufficient.
  const bool is_confirmed = prediction.from_odometry ? quota.share_is_met(matched, possible) ||
                                                           possible < quota.min_matched
                                                     : quota.is_met(matched, possible);
  return {std::move(placement), is_confirmed};
}

SearchResult PlaceRecogniser::search(const model::Keyframe& keyframe, const GlobalMap& map) const {
  // Search of a pose by the constellation of landmarks.
  std::vector<constellation::ObservedPoint> points;
  for (const model::KeyframeLandmark& landmark : keyframe.landmarks)
    points.push_back({landmark.position_m, std::sqrt(plane_variance(landmark))});
  const constellation::Localisation found = map.landmarks.index().localise(points);
  SearchResult result;
  result.hypotheses = found.hypotheses;
  result.log10_false_alarm = found.log10_false_alarm;
  if (!found.found()) {
    result.reason = describe(found.outcome);
    return result;
  }

  // Association around that pose. The pose is from the same landmarks, so its information is
  // removed.
  const geometry::SE2WithCovariance guess{found.map_T_sensor, found.covariance};
  result.placement =
      associate(keyframe, guess, seen_from(found.associations, map), std::nullopt, map);
  Eigen::Matrix3d& covariance = result.placement->map_T_centre.covariance;
  covariance = without_guess(covariance, guess.covariance);
  if (result.placement->associations.size() < static_cast<std::size_t>(parameters_.min_matched)) {
    result.placement.reset();
    result.reason = "the place found has too few matching landmarks";
  }
  return result;
}

}  // namespace understory::geoslam_mapper::smoothing
