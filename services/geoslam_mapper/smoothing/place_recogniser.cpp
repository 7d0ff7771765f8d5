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

/// Beyond the field of view, so that a landmark at its edge is found whatever the pose's error.
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

/// Gates up to this size [m] tell landmarks apart, also those that the map does not have.
constexpr double kNarrow_m = 0.3;
/// The same of landmarks of a given map, before this drive has seen them: most of what their
/// covariances say is common to all around, and the vehicle was placed among these.
constexpr double kNarrowGiven_m = 1.0;

/// Whether the gate of a landmark that does not share the reference's error is so wide that another
/// one may be meant. All of a pass are off together then.
bool is_loose(const StoredLandmark& landmark, double gate_m,
              const std::optional<Reference>& reference, int recent_keyframes,
              const Trajectory& trajectory) {
  const double narrow_m = landmark.nodes.empty() ? kNarrowGiven_m : kNarrow_m;
  return gate_m > narrow_m &&
         !(reference && is_recent(landmark, *reference, recent_keyframes, trajectory));
}

/// Where the vehicle is in the frame of the map, by the last keyframe. A graph that is not solved,
/// since the map stays as it is, does not tell; there odometry's prediction does, and one by what
/// the keyframer tracked, whose noise is assumed, counts as exact.
geometry::SE2WithCovariance vehicle_in_map(const Prediction& prediction, const GlobalMap& map) {
  if (!map.trajectory.bases().empty()) {
    geometry::SE2WithCovariance last = map.graph.marginal(map.trajectory.last().node);
    if (!last.covariance.isZero(0.0)) return last;
  }
  if (prediction.from_odometry) return prediction.map_T_centre;
  return {prediction.map_T_centre.mean, Eigen::Matrix3d::Zero()};
}

/// What the pose of the vehicle leaves uncertain of where a place of the map is to it, per axis
/// [m^2].
double variance_from(const geometry::SE2WithCovariance& map_T_vehicle,
                     const Eigen::Vector2d& place_m) {
  const Eigen::Matrix<double, 2, 3> j = plane::linearise(map_T_vehicle.mean, place_m).pose;
  return 0.5 * (j * map_T_vehicle.covariance * j.transpose()).trace();
}

/// The last keyframe; none where the map has none.
std::optional<Reference> last_keyframe(const GlobalMap& map) {
  if (map.trajectory.bases().empty()) return std::nullopt;
  return Reference{map.trajectory.last().node, map.trajectory.size()};
}

/// What saw the landmarks among which the vehicle was found: the middle one of those that the
/// graph has, in the order in which they were seen last.
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

/// How many of the keyframe's landmarks could be in the map: not more than the map has in the field
/// of view, without those that are loose.
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

/// Covariance of a registration without the information of its guess; where that leaves none, the
/// guess's own.
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
    // One of the given map that no keyframe saw lies in the frame of the map, as the vehicle does.
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

  // The keyframe registered to the map.
  geometry::RegistrationParameters gating;
  gating.gate_sigmas = parameters_.gate_sigmas;
  gating.gate_floor_m = parameters_.gate_floor_m;
  const geometry::SE2WithCovariance broad{guess.mean,
                                          guess.covariance + 1e-8 * Eigen::Matrix3d::Identity()};
  const geometry::Registration found = register_points(reference, observed, broad, gating);

  // Pairs of the same kind.
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

  // Odometry alone will do where there is next to nothing to match.
  const bool is_confirmed = prediction.from_odometry ? quota.share_is_met(matched, possible) ||
                                                           possible < quota.min_matched
                                                     : quota.is_met(matched, possible);
  return {std::move(placement), is_confirmed};
}

SearchResult PlaceRecogniser::search(const model::Keyframe& keyframe, const GlobalMap& map) const {
  // A pose by the constellation of landmarks.
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

  // Association around that pose, which rests on the same landmarks: they count once.
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
