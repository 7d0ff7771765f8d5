#include "services/geoslam_mapper/smoothing/earlier_pass.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// With this sigma of the distance to a pass [m], gates are sufficient to match its landmarks.
constexpr double kKnown_m = 0.1;
/// Largest number of passes considered.
constexpr std::size_t kMostPasses = 4;

double larger_sigma(const Eigen::Matrix3d& covariance) {
  const Eigen::Matrix2d position = covariance.topLeftCorner<2, 2>();
  return std::sqrt(
      std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(position, Eigen::EigenvaluesOnly)
                        .eigenvalues()
                        .maxCoeff()));
}

/// A node of an earlier pass.
struct NearNode {
  double along_m = 0.0;
  double distance_m = 0.0;
  std::optional<NodeIndex> node;
  bool is_given = false;
};

/// The nearest node of each pass, nearest first.
std::vector<NearNode> nearest_of_each(std::vector<NearNode> nodes) {
  std::sort(nodes.begin(), nodes.end(),
            [](const NearNode& a, const NearNode& b) { return a.along_m < b.along_m; });
  std::vector<NearNode> nearest;
  double last_m = 0.0;
  for (const NearNode& node : nodes) {
    if (nearest.empty() || node.along_m - last_m > kAnotherPass_m) {
      nearest.push_back(node);
    } else if (node.distance_m < nearest.back().distance_m) {
      nearest.back() = node;
    }
    last_m = node.along_m;
  }
  std::sort(nearest.begin(), nearest.end(),
            [](const NearNode& a, const NearNode& b) { return a.distance_m < b.distance_m; });
  return nearest;
}

/// A given map has no path. Its landmarks that were not observed yet form a pass: in their given
/// frame, or, if it came with an absorbed map, relative to the node that represents that map's
/// origin.
std::optional<NearNode> given_around(const Eigen::Vector2d& here_m, double range_m,
                                     const GlobalMap& map) {
  for (const model::LandmarkId id : map.landmarks.index().near({here_m, range_m})) {
    const StoredLandmark& landmark = map.landmarks.at(id);
    if (landmark.last_keyframe > 0) continue;
    if (landmark.is_given()) return NearNode{0.0, 0.0, std::nullopt, true};
    if (!landmark.nodes.empty() && (map.graph.position(id) || map.graph.is_dormant(id)))
      return NearNode{0.0, 0.0, landmark.nodes.front(), true};
  }
  return std::nullopt;
}

/// Pose of the queried node relative to the pass.
std::optional<geometry::SE2WithCovariance> relative_to(const NearNode& pass, NodeIndex at,
                                                       const PoseGraph& graph) {
  if (pass.node) return graph.relative(*pass.node, at);
  const geometry::SE2WithCovariance map_T_at = graph.marginal(at);
  if (map_T_at.covariance.isZero(0.0)) return std::nullopt;
  return map_T_at;
}

}  // namespace

std::vector<EarlierPass> find_earlier_passes(const model::FieldOfView& field_of_view, NodeIndex at,
                                             const GlobalMap& map) {
  const Eigen::Vector2d here_m = map.graph.pose(at).translation();
  const double along_m = map.graph.node(at).along_m;
  const double sigma_m = larger_sigma(map.graph.marginal(at).covariance);
  const double reach_m =
      std::min(kFurthestPass_m, kReachOfPasses_sigmas * sigma_m + field_of_view.max_range_m);

  std::vector<NearNode> near;
  map.trajectory.for_each_node_near(here_m, reach_m, map.graph,
                                    [&](NodeIndex node, double distance_m) {
                                      const double its_m = map.graph.node(node).along_m;
                                      if (along_m - its_m >= kAnotherPass_m)
                                        near.push_back({its_m, distance_m, node, false});
                                    });
  std::vector<NearNode> passes = nearest_of_each(std::move(near));
  if (passes.size() > kMostPasses) passes.resize(kMostPasses);
  if (const auto given = given_around(here_m, field_of_view.max_range_m, map); given)
    passes.push_back(*given);

  std::vector<EarlierPass> found;
  for (const NearNode& pass : passes) {
    auto relative = relative_to(pass, at, map.graph);
    if (!relative) continue;
    const double relative_m = larger_sigma(relative->covariance);
    if (relative_m >= kKnown_m)
      found.push_back({pass.node, *std::move(relative), relative_m, pass.is_given});
  }
  return found;
}

}  // namespace understory::geoslam_mapper::smoothing
