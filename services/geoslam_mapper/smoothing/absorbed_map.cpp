#include "services/geoslam_mapper/smoothing/absorbed_map.hpp"

#include <limits>
#include <optional>

#include "services/geoslam_mapper/smoothing/loose_graph.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Path length [m] between the end of the other map and the beginning of this one: the whole other
/// map becomes an earlier pass.
constexpr double kBefore_m = 1000.0;
/// Sigma of the motion between the two until they are joined [m], [rad].
constexpr double kLooseSigma_m = 10.0;
constexpr double kLooseSigma_rad = 0.3;

/// Path length [m] at the newest node of a map that has one.
double driven_m(const PoseGraph& graph) {
  return graph.newest() ? graph.node(*graph.newest()).along_m : 0.0;
}

/// Given landmarks count as observed from a new node at the origin of their map.
std::optional<NodeIndex> observe_given(const LandmarkMap& landmarks, double along_m,
                                       LooseGraph& loose) {
  const auto origin = static_cast<NodeIndex>(loose.nodes.size());
  bool has_given = false;
  for (const auto& [id, landmark] : landmarks.all()) {
    if (!landmark.is_given()) continue;
    has_given = true;
    const auto known = loose.given.find(id);
    DormantObservation given{origin, landmark.position_m, landmark.prior_covariance.inverse()};
    if (known != loose.given.end())
      given = {origin, known->second.position_m, known->second.information};
    const auto solved = loose.solved.find(id);
    (solved == loose.solved.end() ? loose.dormant[id] : solved->second.observed).push_back(given);
  }
  if (!has_given) return std::nullopt;

  LooseGraph::LooseNode& node = loose.nodes.emplace_back();
  node.node.along_m = along_m;
  node.node.is_condensed = true;
  return origin;
}

/// The node of the other map that is nearest to the vehicle.
NodeIndex nearest_to(const Eigen::Vector2d& here_m, const LooseGraph& loose) {
  NodeIndex nearest = 0;
  double least_m = std::numeric_limits<double>::infinity();
  for (NodeIndex node = 0; node < loose.nodes.size(); ++node) {
    const double distance_m = (loose.nodes[node].pose.translation() - here_m).norm();
    if (loose.nodes[node].is_free || distance_m >= least_m) continue;
    least_m = distance_m;
    nearest = node;
  }
  return nearest;
}

geometry::SE2WithCovariance loosely(const geometry::SE2& a_T_b) {
  const Eigen::Vector3d sigma(kLooseSigma_m, kLooseSigma_m, kLooseSigma_rad);
  return {a_T_b, sigma.cwiseAbs2().asDiagonal()};
}

}  // namespace

std::vector<model::LandmarkId> absorb(GlobalMap other, const geometry::SE2& map_T_other,
                                      GlobalMap& map) {
  LooseGraph loose = other.graph.loosened();
  const auto origin = observe_given(other.landmarks, driven_m(other.graph), loose);
  const NodeIndex newest = *map.graph.newest();
  const double further_m = -kBefore_m - driven_m(other.graph);
  const geometry::SE2 other_T_newest = map_T_other.inverse() * map.graph.pose(newest);
  const NodeIndex near = nearest_to(other_T_newest.translation(), loose);

  // The graph.
  map.graph.checkpoint();
  const NodeIndex first = map.graph.absorb(loose, map_T_other, further_m);
  map.graph.add_closure(kAbsorbing, first + near, newest,
                        loosely(loose.nodes[near].pose.inverse() * other_T_newest));

  // Data of its landmarks and keyframes.
  std::vector<model::LandmarkId> ids;
  for (StoredLandmark landmark : other.landmarks.release()) {
    for (NodeIndex& node : landmark.nodes) node += first;
    if (landmark.is_given()) landmark.nodes.insert(landmark.nodes.begin(), first + *origin);
    landmark.prior_covariance.setZero();
    landmark.position_m = map_T_other * landmark.position_m;
    landmark.last_keyframe = 0;
    for (float& view_m : landmark.views_m) view_m += static_cast<float>(further_m);
    ids.push_back(landmark.id);
    map.landmarks.bring_back(std::move(landmark));
  }
  map.trajectory.absorb(std::move(other.trajectory), first, map.graph);

  (void)map.graph.solve();
  map.adopt_estimates();
  return ids;
}

}  // namespace understory::geoslam_mapper::smoothing
