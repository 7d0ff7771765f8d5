#include "services/geoslam_mapper/smoothing/pass_joiner.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "services/geoslam_mapper/smoothing/earlier_pass.hpp"
#include "services/geoslam_mapper/smoothing/pass_match.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Path length [m] between searches, and between remembered places without a result; and the
/// largest number of these.
constexpr double kBetweenSearches_m = 4.0;
constexpr double kBetweenPlaces_m = 20.0;
constexpr std::size_t kMostPlaces = 64;
/// A node represents a remembered place within this path length [m].
constexpr double kSamePlace_m = 10.0;
/// Iterations of the graph for a large correction.
constexpr int kRounds = 10;

/// Sum of chi^2 of the landmarks' observations.
double misfit(const std::vector<MergedPair>& pairs, const GlobalMap& map, bool joined) {
  double sum = 0.0;
  const auto add = [&](model::LandmarkId id, const StoredLandmark& landmark) {
    for (const NodeIndex node : landmark.nodes)
      if (map.graph.node(node).observations().contains(id)) sum += map.graph.chi2(node, id);
  };
  for (const auto& [old_id, new_id] : pairs) {
    add(new_id, map.landmarks.at(new_id));
    add(joined ? new_id : old_id, map.landmarks.at(old_id));
  }
  return sum;
}

/// A landmark of the given map with its given values.
struct Given {
  model::LandmarkId id = 0;  ///< Its present id.
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();
};

/// Adds those of the pairs that no keyframe observed yet to the graph.
std::vector<Given> enter_given(const std::vector<MergedPair>& pairs, GlobalMap& map) {
  std::vector<Given> given;
  for (const auto& [old_id, new_id] : pairs) {
    for (const model::LandmarkId id : {old_id, new_id}) {
      const StoredLandmark& landmark = map.landmarks.at(id);
      if (!landmark.is_given_unseen()) continue;
      map.enter_given(id);
      given.push_back({new_id, landmark.position_m, landmark.prior_covariance});
    }
  }
  return given;
}

/// Sum of chi^2 of their priors.
double misfit(const std::vector<Given>& given, const GlobalMap& map) {
  double sum = 0.0;
  for (const Given& one : given) {
    const Eigen::Vector2d off_m = *map.graph.position(one.id) - one.position_m;
    sum += off_m.dot(one.covariance_m2.inverse() * off_m);
  }
  return sum;
}

/// The node nearest to a place on the path; none if it was removed.
std::optional<NodeIndex> node_at(const WaitingPlace& place, const GlobalMap& map) {
  std::optional<NodeIndex> nearest;
  double nearest_m = kSamePlace_m;
  map.trajectory.for_each_node_near(
      place.position_m, kFurthestPass_m, map.graph, [&](NodeIndex node, double) {
        const double off_m = std::abs(map.graph.node(node).along_m - place.along_m);
        if (off_m >= nearest_m) return;
        nearest_m = off_m;
        nearest = node;
      });
  return nearest;
}

}  // namespace

JoinedPasses PassJoiner::follow(const model::FieldOfView& field_of_view, NodeIndex newest,
                                Merges& merges, GlobalMap& map) {
  if (!parameters_.use_odometry) return {};
  JoinedPasses joined;
  const double along_m = map.graph.node(newest).along_m;
  if (along_m - tried_m_ >= kBetweenSearches_m) {
    tried_m_ = along_m;
    const bool is_far = places_.empty() || along_m - places_.back().along_m >= kBetweenPlaces_m;
    bool might = false;
    joined = join_at(field_of_view, newest, merges, map, might);
    if (joined.pairs.empty() && might && is_far) {
      places_.push_back({along_m, map.graph.pose(newest).translation()});
      if (places_.size() > kMostPlaces) places_.erase(places_.begin());
    }
  } else if (to_try_ > 0) {
    joined = try_again(field_of_view, merges, map);
  }

  // The new join may determine earlier places.
  if (!joined.pairs.empty()) to_try_ = places_.size();
  return joined;
}

/// Searches again at one place without a result, newest first.
JoinedPasses PassJoiner::try_again(const model::FieldOfView& field_of_view, Merges& merges,
                                   GlobalMap& map) {
  to_try_ = std::min(to_try_, places_.size());
  if (to_try_ == 0) return {};
  const auto place = places_.begin() + static_cast<std::ptrdiff_t>(--to_try_);
  bool might = false;
  JoinedPasses joined;
  if (const auto node = node_at(*place, map))
    joined = join_at(field_of_view, *node, merges, map, might);
  if (!might || !joined.pairs.empty()) places_.erase(place);
  return joined;
}

/// `might`: set if the distance to another pass is unknown and both observed enough landmarks.
JoinedPasses PassJoiner::join_at(const model::FieldOfView& field_of_view, NodeIndex node,
                                 Merges& merges, GlobalMap& map, bool& might) const {
  for (const EarlierPass& pass : find_earlier_passes(field_of_view, node, map)) {
    const Scene scene = scene_around(field_of_view, node, pass, map);
    if (std::min(scene.ours.ids.size(), scene.theirs.ids.size()) < kFewestOfPass) continue;
    might = true;
    std::vector<MergedPair> pairs = match_passes(scene, parameters_, map);
    if (pairs.empty()) continue;
    if (JoinedPasses joined = join(std::move(pairs), merges, map); !joined.pairs.empty())
      return joined;
  }
  return {};
}

/// Joins all pairs or none.
JoinedPasses PassJoiner::join(std::vector<MergedPair> pairs, Merges& merges, GlobalMap& map) const {
  std::vector<model::LandmarkId> ids;
  for (const auto& [old_id, new_id] : pairs) ids.insert(ids.end(), {old_id, new_id});
  map.unfreeze();
  map.wake(ids);
  const double before = misfit(pairs, map, false);
  std::vector<std::vector<HandedOver>> handed_over;
  handed_over.reserve(pairs.size());
  map.graph.checkpoint();
  const std::vector<Given> given = enter_given(pairs, map);
  for (const auto& [old_id, new_id] : pairs)
    handed_over.push_back(map.graph.hand_over(old_id, new_id, map.landmarks.at(old_id).nodes));

  // chi^2 may grow by the degrees of freedom of the merged landmarks: two per pair.
  const auto freedom = 2.0 * static_cast<double>(pairs.size());
  const double most =
      before + freedom + parameters_.max_innovation_sigmas * std::sqrt(2.0 * freedom);
  bool fits = false;
  for (int round = 0; round < kRounds && !fits; ++round) {
    if (!map.graph.solve().ok) break;
    fits = misfit(pairs, map, true) + misfit(given, map) <= most;
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
