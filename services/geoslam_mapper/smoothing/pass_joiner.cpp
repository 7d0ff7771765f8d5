#include "services/geoslam_mapper/smoothing/pass_joiner.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "common/geometry/registration.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// A landmark or node that was seen last so long ago on the way [m] is of an earlier pass.
constexpr double kAnotherPass_m = 50.0;
/// The vehicle drives so far [m] from one search to the next.
constexpr double kBetweenSearches_m = 4.0;
/// Where the vehicle's distance to the earlier pass is known this well [m], gates find its
/// landmarks.
constexpr double kKnown_m = 0.1;
/// What the landmarks around the vehicle leave uncertain of their distances [m].
constexpr double kLocalSigma_m = 0.08;
/// Landmarks of this pass are taken so far around the vehicle [m], or as far as the sensor sees.
constexpr double kScene_m = 45.0;
/// Fewest landmarks of either pass, and most of this one: the nearest.
constexpr std::size_t kLeast = 4;
constexpr std::size_t kMost = 64;
/// Squared Mahalanobis distance of the place found to what the graph knows of it (3 degrees of
/// freedom): by chance one in 1e4; noise that is stated too small by half has as much.
constexpr double kExpected = 85.0;
/// Log10 of the chance that a place is wrong.
constexpr double kMostLog10Chance = -5.0;
/// Largest squared Mahalanobis distance of a pair that joins passes: 78 % of them, the others are
/// judged one by one; what each pass bends between its landmarks [m].
constexpr double kGoodFit = 3.0;
constexpr double kWarp_m = 0.05;
/// What was seen last on so much of the way [m] is of one pass: others may lie there and be off
/// from it.
constexpr double kOnePass_m = 100.0;
/// Rounds of the graph for a large correction.
constexpr int kRounds = 10;

double path_at_last_sight(const StoredLandmark& landmark, const PoseGraph& graph) {
  return landmark.nodes.empty() ? -std::numeric_limits<double>::infinity()
                                : graph.node(landmark.nodes.back()).along_m;
}

/// Where the earlier pass saw the middle one of these pairs last, on its way [m].
double middle_path(const std::vector<std::pair<model::LandmarkId, model::LandmarkId>>& pairs,
                   const GlobalMap& map) {
  std::vector<double> paths_m;
  paths_m.reserve(pairs.size());
  for (const auto& [ours, theirs] : pairs)
    paths_m.push_back(path_at_last_sight(map.landmarks.at(theirs), map.graph));
  const auto middle = paths_m.begin() + static_cast<std::ptrdiff_t>(paths_m.size() / 2);
  std::nth_element(paths_m.begin(), middle, paths_m.end());
  return paths_m.empty() ? 0.0 : *middle;
}

double larger_sigma(const Eigen::Matrix3d& covariance) {
  const Eigen::Matrix2d position = covariance.topLeftCorner<2, 2>();
  return std::sqrt(
      std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(position, Eigen::EigenvaluesOnly)
                        .eigenvalues()
                        .maxCoeff()));
}

/// Bound on log10 of the chance that `hits` or more of `tries` hit, each with this chance
/// (Chernoff; Hoeffding 1963, theorem 1).
double log10_chance(std::size_t tries, std::size_t hits, double chance) {
  const double n = static_cast<double>(tries);
  const double share = static_cast<double>(hits) / n;
  if (share <= chance) return 0.0;
  double nats = share * std::log(share / chance);
  if (share < 1.0) nats += (1.0 - share) * std::log((1.0 - share) / (1.0 - chance));
  return -n * nats / std::numbers::ln10;
}

/// Sum of what the observations of landmarks leave unexplained.
double misfit(const std::vector<MergedPair>& pairs, const GlobalMap& map, bool joined) {
  double sum = 0.0;
  const auto add = [&](model::LandmarkId id, const StoredLandmark& landmark) {
    for (const NodeIndex node : landmark.nodes)
      if (map.graph.node(node).observations.contains(id)) sum += map.graph.chi2(node, id);
  };
  for (const auto& [old_id, new_id] : pairs) {
    add(new_id, map.landmarks.at(new_id));
    add(joined ? new_id : old_id, map.landmarks.at(old_id));
  }
  return sum;
}

/// What a landmark around was told from that came with another map and was not seen since: a given
/// map has no path. None where there is none.
std::optional<NodeIndex> given_around(const Eigen::Vector2d& here_m, double range_m,
                                      const GlobalMap& map) {
  for (const model::LandmarkId id : map.landmarks.index().near({here_m, range_m})) {
    const StoredLandmark& landmark = map.landmarks.at(id);
    if (landmark.last_keyframe > 0 || landmark.nodes.empty()) continue;
    if (map.graph.position(id) || map.graph.is_dormant(id)) return landmark.nodes.front();
  }
  return std::nullopt;
}

}  // namespace

JoinedPasses PassJoiner::follow(const model::FieldOfView& field_of_view, NodeIndex newest,
                                Merges& merges, GlobalMap& map) {
  const double along_m = map.graph.node(newest).along_m;
  if (!parameters_.use_odometry || along_m - tried_m_ < kBetweenSearches_m) return {};
  tried_m_ = along_m;

  const auto pass = earlier_pass(field_of_view, newest, map);
  if (!pass) return {};
  const Scene scene = scene_around(field_of_view, newest, *pass, map);
  if (scene.ours.size() < kLeast || scene.theirs.size() < kLeast) return {};
  std::vector<MergedPair> pairs = find(scene, newest, *pass, map);
  if (pairs.size() < kLeast) return {};
  return join(std::move(pairs), merges, map);
}

/// The node of another pass that is nearest to where the vehicle seems to be, or that of a map that
/// was given.
std::optional<PassJoiner::EarlierPass> PassJoiner::earlier_pass(
    const model::FieldOfView& field_of_view, NodeIndex newest, const GlobalMap& map) const {
  const Eigen::Vector2d here_m = map.graph.pose(newest).translation();
  const double along_m = map.graph.node(newest).along_m;
  const double sigma_m = larger_sigma(map.graph.marginal(newest).covariance);
  const double reach_m = std::min(kFurthest_m, kReach_sigmas * sigma_m + field_of_view.max_range_m);

  EarlierPass pass;
  double nearest_m = std::numeric_limits<double>::infinity();
  map.trajectory.for_each_node_near(
      here_m, reach_m, map.graph, [&](NodeIndex node, double distance_m) {
        if (along_m - map.graph.node(node).along_m < kAnotherPass_m || distance_m >= nearest_m)
          return;
        nearest_m = distance_m;
        pass.node = node;
      });
  if (nearest_m > reach_m) {
    const auto given = given_around(here_m, field_of_view.max_range_m, map);
    if (!given) return std::nullopt;
    pass.node = *given;
  }

  auto relative = map.graph.relative(pass.node, newest);
  if (!relative) return std::nullopt;
  pass.node_T_newest = *std::move(relative);
  pass.sigma_m = larger_sigma(pass.node_T_newest.covariance);
  if (pass.sigma_m < kKnown_m) return std::nullopt;
  return pass;
}

PassJoiner::Scene PassJoiner::scene_around(const model::FieldOfView& field_of_view,
                                           NodeIndex newest, const EarlierPass& pass,
                                           const GlobalMap& map) const {
  const Eigen::Vector2d here_m = map.graph.pose(newest).translation();
  const double limit_m = map.graph.node(newest).along_m - kAnotherPass_m;
  const double range_m = std::max(field_of_view.max_range_m, kScene_m);
  Scene scene;
  scene.reach_m = range_m + std::min(kFurthest_m, kReach_sigmas * pass.sigma_m);

  std::vector<std::pair<double, model::LandmarkId>> ours;
  for (const model::LandmarkId id : map.landmarks.index().near({here_m, scene.reach_m})) {
    const StoredLandmark& landmark = map.landmarks.at(id);
    if (!map.graph.position(id) && !map.graph.is_dormant(id)) continue;
    const double distance_m = (landmark.position_m - here_m).norm();
    if (path_at_last_sight(landmark, map.graph) < limit_m) {
      scene.theirs.push_back(id);
    } else if (distance_m < range_m) {
      ours.emplace_back(distance_m, id);
    }
  }

  std::sort(ours.begin(), ours.end());
  if (ours.size() > kMost) ours.resize(kMost);
  for (const auto& [distance, id] : ours) scene.ours.push_back(id);
  return scene;
}

/// Pairs of a landmark of this pass and one of earlier passes, where the graph expects the passes.
std::vector<MergedPair> PassJoiner::find(const Scene& scene, NodeIndex newest,
                                         const EarlierPass& pass, const GlobalMap& map) const {
  auto match = match_by_gates(scene, newest, pass, map);
  if (!match) match = match_by_constellation(scene, newest, pass, map);
  if (!match) return {};

  const geometry::SE2 node_T_found = map.graph.pose(pass.node).inverse() * match->map_T_newest.mean;
  const Eigen::Vector3d off = (pass.node_T_newest.mean.inverse() * node_T_found).Log();
  const Eigen::Matrix3d covariance = pass.node_T_newest.covariance + match->map_T_newest.covariance;
  if (off.dot(covariance.inverse() * off) > kExpected) return {};

  // Only pairs of one earlier pass that fit well: the others are judged one by one when the passes
  // are joined.
  std::vector<MergedPair> pairs;
  const double pass_m = middle_path(match->pairs, map);
  const geometry::SE2 found_T_now = match->map_T_newest.mean * map.graph.pose(newest).inverse();
  for (const auto& [ours, theirs] : match->pairs) {
    const StoredLandmark& a = map.landmarks.at(ours);
    const StoredLandmark& b = map.landmarks.at(theirs);
    const double variance = a.local_variance() + b.local_variance() + kWarp_m * kWarp_m;
    const double squared = (found_T_now * a.position_m - b.position_m).squaredNorm() / variance;
    const bool is_of_another = std::abs(path_at_last_sight(b, map.graph) - pass_m) > kOnePass_m;
    if (a.kind == b.kind && squared <= kGoodFit && !is_of_another)
      pairs.push_back(Merges::in_order(ours, theirs, map.landmarks));
  }
  return pairs;
}

/// Where the passes' distance is known to less than the landmarks stand apart.
std::optional<PassJoiner::Match> PassJoiner::match_by_gates(const Scene& scene, NodeIndex newest,
                                                            const EarlierPass& pass,
                                                            const GlobalMap& map) const {
  geometry::RegistrationParameters gating;
  gating.gate_sigmas = parameters_.gate_sigmas;
  gating.gate_floor_m = parameters_.gate_floor_m;
  if (kReach_sigmas * pass.sigma_m > gating.max_gate_m) return std::nullopt;

  // Registration around where the graph expects it.
  const geometry::SE2 map_T_newest = map.graph.pose(newest);
  const geometry::SE2 newest_T_map = map_T_newest.inverse();
  std::vector<geometry::UncertainPoint> reference;
  std::vector<geometry::UncertainPoint> observed;
  for (const model::LandmarkId id : scene.theirs) {
    const StoredLandmark& landmark = map.landmarks.at(id);
    reference.push_back({landmark.position_m, landmark.local_variance()});
  }
  double spread_m2 = 0.0;
  for (const model::LandmarkId id : scene.ours) {
    const StoredLandmark& landmark = map.landmarks.at(id);
    observed.push_back({newest_T_map * landmark.position_m, landmark.local_variance()});
    spread_m2 = std::max(spread_m2, observed.back().variance_m2);
  }
  const geometry::Registration found = geometry::register_points(
      reference, observed, {map_T_newest, pass.node_T_newest.covariance}, gating);

  // Could chance give so many pairs?
  const double gate_m = gating.gate_sigmas * std::sqrt(spread_m2 + kLocalSigma_m * kLocalSigma_m) +
                        gating.gate_floor_m;
  const double by_chance =
      static_cast<double>(scene.theirs.size()) * gate_m * gate_m / (scene.reach_m * scene.reach_m);
  const double places = std::pow(std::max(1.0, kReach_sigmas * pass.sigma_m / gate_m), 3.0);
  if (log10_chance(observed.size(), found.pairs.size(), by_chance) + std::log10(places) >
      kMostLog10Chance) {
    return std::nullopt;
  }

  Match match{{found.reference_T_observed, found.covariance}, {}};
  for (const geometry::PointPair& pair : found.pairs)
    match.pairs.emplace_back(scene.ours[pair.observed], scene.theirs[pair.reference]);
  return match;
}

std::optional<PassJoiner::Match> PassJoiner::match_by_constellation(const Scene& scene,
                                                                    NodeIndex newest,
                                                                    const EarlierPass& pass,
                                                                    const GlobalMap& map) const {
  const geometry::SE2 map_T_newest = map.graph.pose(newest);
  const geometry::SE2 newest_T_map = map_T_newest.inverse();
  constellation::ConstellationMap theirs;
  for (const model::LandmarkId id : scene.theirs)
    theirs.insert(id, map.landmarks.at(id).position_m);
  std::vector<constellation::ObservedPoint> ours;
  for (const model::LandmarkId id : scene.ours) {
    const StoredLandmark& landmark = map.landmarks.at(id);
    ours.push_back({newest_T_map * landmark.position_m, std::sqrt(landmark.local_variance())});
  }

  constellation::LocaliseParameters localising;
  localising.map_sigma_m = kLocalSigma_m;
  const constellation::Disc where{map_T_newest.translation(),
                                  std::max(1.0, kReach_sigmas * pass.sigma_m)};
  const constellation::Localisation found = theirs.localise(ours, localising, where);
  if (!found.found()) return std::nullopt;

  Match match{{found.map_T_sensor, found.covariance}, {}};
  for (const constellation::PointAssociation& one : found.associations)
    match.pairs.emplace_back(scene.ours[one.observed], one.landmark_id);
  return match;
}

/// All or none.
JoinedPasses PassJoiner::join(std::vector<MergedPair> pairs, Merges& merges, GlobalMap& map) const {
  std::vector<model::LandmarkId> ids;
  for (const auto& [old_id, new_id] : pairs) ids.insert(ids.end(), {old_id, new_id});
  map.unfreeze();
  map.wake(ids);
  const double before = misfit(pairs, map, false);
  std::vector<std::vector<HandedOver>> handed_over;
  handed_over.reserve(pairs.size());
  map.graph.checkpoint();
  for (const auto& [old_id, new_id] : pairs)
    handed_over.push_back(map.graph.hand_over(old_id, new_id, map.landmarks.at(old_id).nodes));

  // What is left unexplained grows as two numbers each tell where one landmark is.
  const auto freedom = 2.0 * static_cast<double>(pairs.size());
  const double most =
      before + freedom + parameters_.max_innovation_sigmas * std::sqrt(2.0 * freedom);
  bool fits = false;
  for (int round = 0; round < kRounds && !fits; ++round) {
    if (!map.graph.solve().ok) break;
    fits = misfit(pairs, map, true) <= most;
  }
  if (!fits) {
    map.graph.rollback();
    return {};
  }

  for (std::size_t i = 0; i < pairs.size(); ++i)
    merges.adopt(pairs[i], std::move(handed_over[i]), map);
  return {std::move(pairs), map.adopt_estimates()};
}

}  // namespace understory::geoslam_mapper::smoothing
