#include "services/geoslam_mapper/smoothing/pass_match.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "common/constellation/localisation.hpp"
#include "services/geoslam_mapper/smoothing/pair_search.hpp"
#include "services/geoslam_mapper/smoothing/pass_odds.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Sigma of the distances among the landmarks around the vehicle [m].
constexpr double kLocalSigma_m = 0.08;
/// Landmarks of the node's pass are collected within this distance [m], or within the sensor's
/// range.
constexpr double kScene_m = 45.0;
/// Most landmarks of the node's pass; the nearest are taken.
constexpr std::size_t kMost = 64;
/// With at most this number of possible pairs, all pairs of pairs are tested.
constexpr std::size_t kPoor = 400;
/// Largest squared Mahalanobis distance of a pair that joins passes from its position by the
/// others: 78 % of correct pairs; and the largest variance of that [m^2], since trunks in clumps
/// stand 0.3 m apart. The other pairs are judged singly when the passes are joined.
constexpr double kGoodFit = 3.0;
constexpr double kTellsPairs_m2 = 0.02;
/// Up to this number of pairs only the joint odds are tested, not each pair against the others.
constexpr std::size_t kFewPairs = 3;
/// Sigma of each pass's deformation between its landmarks [m].
constexpr double kWarp_m = 0.05;
/// Landmarks observed within this path length [m] of a node of an earlier pass belong to that pass:
/// other passes may lie there with another error.
constexpr double kOnePass_m = 100.0;

/// Whether the landmark was observed within this path length of a node.
bool is_seen_around(NodeIndex node, double within_m, const StoredLandmark& landmark,
                    const PoseGraph& graph) {
  const double along_m = graph.node(node).along_m;
  return std::any_of(landmark.nodes.begin(), landmark.nodes.end(), [&](NodeIndex other) {
    return std::abs(graph.node(other).along_m - along_m) < within_m;
  });
}

/// Variance of the distance of two landmarks of different passes, per axis [m^2].
double variance_of(const geometry::UncertainPoint& ours, const geometry::UncertainPoint& theirs) {
  return ours.variance_m2 + theirs.variance_m2 + kWarp_m * kWarp_m;
}

std::optional<FoundPlace> match_by_gates(const Scene& scene,
                                         const SmoothingMapperParameters& parameters) {
  geometry::RegistrationParameters gating;
  gating.gate_sigmas = parameters.gate_sigmas;
  gating.gate_floor_m = parameters.gate_floor_m;
  if (kReachOfPasses_sigmas * scene.sigma_m > gating.max_gate_m) return std::nullopt;

  geometry::Registration found =
      geometry::register_points(scene.theirs.points, scene.ours.points, scene.map_T_node, gating);
  return FoundPlace{{found.reference_T_observed, found.covariance}, std::move(found.pairs)};
}

std::optional<FoundPlace> match_by_constellation(const Scene& scene) {
  constellation::ConstellationMap theirs;
  for (std::size_t i = 0; i < scene.theirs.ids.size(); ++i)
    theirs.insert(i, scene.theirs.points[i].position_m);
  std::vector<constellation::ObservedPoint> ours;
  for (const geometry::UncertainPoint& point : scene.ours.points)
    ours.push_back({point.position_m, std::sqrt(point.variance_m2)});

  constellation::LocaliseParameters localising;
  localising.map_sigma_m = kLocalSigma_m;
  const constellation::Disc where{scene.map_T_node.mean.translation(),
                                  std::max(1.0, kReachOfPasses_sigmas * scene.sigma_m)};
  const constellation::Localisation found = theirs.localise(ours, localising, where);
  if (!found.found()) return std::nullopt;

  FoundPlace place{{found.map_T_sensor, found.covariance}, {}};
  for (const constellation::PointAssociation& one : found.associations)
    place.pairs.push_back({static_cast<std::uint32_t>(one.landmark_id),
                           static_cast<std::uint32_t>(one.observed), false});
  return place;
}

/// The pairs as input of the Bayes factor.
std::vector<PairOfPasses> pairs_of(const FoundPlace& place, const Scene& scene) {
  std::vector<PairOfPasses> pairs;
  for (const geometry::PointPair& pair : place.pairs) {
    const geometry::UncertainPoint& ours = scene.ours.points[pair.observed];
    const geometry::UncertainPoint& theirs = scene.theirs.points[pair.reference];
    pairs.push_back({ours.position_m, theirs.position_m, variance_of(ours, theirs),
                     clutter_around(pair.reference, scene.theirs.points, scene.reach_m)});
  }
  return pairs;
}

}  // namespace

Scene scene_around(const model::FieldOfView& field_of_view, NodeIndex node, const EarlierPass& pass,
                   const GlobalMap& map) {
  const geometry::SE2 map_T_node = map.graph.pose(node);
  const geometry::SE2 node_T_map = map_T_node.inverse();
  const double range_m = std::max(field_of_view.max_range_m, kScene_m);
  const double reach_m = range_m + std::min(kFurthestPass_m, kReachOfPasses_sigmas * pass.sigma_m);
  Scene scene;
  scene.map_T_node = {map_T_node, pass.node_T_asked.covariance};
  scene.sigma_m = pass.sigma_m;

  std::vector<std::pair<double, model::LandmarkId>> ours;
  for (const model::LandmarkId id :
       map.landmarks.index().near({map_T_node.translation(), reach_m})) {
    const StoredLandmark& landmark = map.landmarks.at(id);
    const bool is_given = pass.is_given && landmark.is_given_unseen();
    if (!is_given && !map.graph.position(id) && !map.graph.is_dormant(id)) continue;
    if (is_seen_around(node, kAnotherPass_m, landmark, map.graph)) {
      const double distance_m = (landmark.position_m - map_T_node.translation()).norm();
      if (distance_m < range_m) ours.emplace_back(distance_m, id);
    } else if (pass.is_given || is_seen_around(*pass.node, kOnePass_m, landmark, map.graph)) {
      scene.theirs.ids.push_back(id);
      scene.theirs.points.push_back({landmark.position_m, landmark.local_variance()});
    }
  }
  scene.reach_m = reach_m;

  std::sort(ours.begin(), ours.end());
  if (ours.size() > kMost) ours.resize(kMost);
  for (const auto& [distance, id] : ours) {
    const StoredLandmark& landmark = map.landmarks.at(id);
    scene.ours.ids.push_back(id);
    scene.ours.points.push_back({node_T_map * landmark.position_m, landmark.local_variance()});
  }
  return scene;
}

std::vector<MergedPair> match_passes(const Scene& scene,
                                     const SmoothingMapperParameters& parameters,
                                     const GlobalMap& map) {
  std::optional<FoundPlace> place;
  if (scene.ours.ids.size() * scene.theirs.ids.size() <= kPoor) {
    std::vector<double> clutter_per_m2;
    for (std::size_t i = 0; i < scene.theirs.points.size(); ++i)
      clutter_per_m2.push_back(clutter_around(i, scene.theirs.points, scene.reach_m));
    place = search_pairs(scene.ours.points, scene.theirs.points, kWarp_m * kWarp_m, clutter_per_m2,
                         scene.map_T_node);
  } else {
    place = match_by_gates(scene, parameters);
    if (!place) place = match_by_constellation(scene);
  }
  if (!place || place->pairs.size() < kFewestOfPass) return {};

  // Is the pose within the graph's prediction, and unlikely by chance?
  const std::vector<PairOfPasses> laid = pairs_of(*place, scene);
  const geometry::SE2WithCovariance fitted =
      fit_place(laid, place->map_T_newest.mean, scene.map_T_node);
  const Eigen::Vector3d apart = (scene.map_T_node.mean.inverse() * fitted.mean).Log();
  const double off = apart.dot((scene.map_T_node.covariance + fitted.covariance).inverse() * apart);
  if (off > kMostOff) return {};
  const double least = off <= kWhereExpected ? kLeastLogOddsWhereExpected : kLeastLogOdds;
  if (log_odds_of_place(laid, fitted.mean, scene.map_T_node) < least) return {};

  // Which of the pairs are certain, too?
  const std::vector<LeftOut> others_say = leave_out_each(laid, fitted);
  std::vector<MergedPair> pairs;
  for (std::size_t i = 0; i < laid.size(); ++i) {
    const model::LandmarkId ours = scene.ours.ids[place->pairs[i].observed];
    const model::LandmarkId theirs = scene.theirs.ids[place->pairs[i].reference];
    const LeftOut& said = others_say[i];
    // With few pairs the others cannot test one: only the joint odds count.
    const bool are_few = laid.size() <= kFewPairs;
    const double variance_m2 = laid[i].variance_m2 + (are_few ? said.variance_m2 : 0.0);
    const bool is_one = (are_few || said.variance_m2 <= kTellsPairs_m2) &&
                        said.apart_m.squaredNorm() <= kGoodFit * variance_m2 &&
                        map.landmarks.at(ours).kind == map.landmarks.at(theirs).kind &&
                        // Two landmarks of one given map are different trunks.
                        !(map.landmarks.at(ours).is_given() && map.landmarks.at(theirs).is_given());
    if (is_one) pairs.push_back(Merges::in_order(ours, theirs, map.landmarks));
  }
  return pairs.size() < kFewestOfPass ? std::vector<MergedPair>{} : pairs;
}

}  // namespace understory::geoslam_mapper::smoothing
