#include "services/geoslam_mapper/smoothing/told_map.hpp"

#include "services/geoslam_mapper/point_covariance.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Covariances of landmarks outside the solved graph, from the nodes that observed them last. Zero
/// for the others.
std::vector<Eigen::Matrix2d> by_their_nodes(std::span<const model::LandmarkId> ids,
                                            std::span<const Eigen::Matrix2d> marginals,
                                            const GlobalMap& map) {
  std::vector<std::size_t> unsolved;
  std::vector<NodeIndex> nodes;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const StoredLandmark& landmark = map.landmarks.at(ids[i]);
    if (!marginals[i].isZero(0.0) || landmark.nodes.empty()) continue;
    unsolved.push_back(i);
    nodes.push_back(landmark.nodes.back());
  }

  std::vector<Eigen::Matrix2d> result(ids.size(), Eigen::Matrix2d::Zero());
  const std::vector<Eigen::Matrix3d> of_nodes = map.graph.covariances(nodes);
  for (std::size_t k = 0; k < unsolved.size(); ++k) {
    const StoredLandmark& landmark = map.landmarks.at(ids[unsolved[k]]);
    const geometry::SE2WithCovariance map_T_node{map.graph.pose(nodes[k]), of_nodes[k]};
    result[unsolved[k]] =
        point_covariance(map_T_node, map_T_node.mean.inverse() * landmark.position_m) +
        landmark.local_variance() * Eigen::Matrix2d::Identity();
  }
  return result;
}

}  // namespace

void set_covariances(std::span<model::MapLandmark> landmarks, const GlobalMap& map,
                     const CommonError& common) {
  std::vector<model::LandmarkId> ids;
  ids.reserve(landmarks.size());
  for (const model::MapLandmark& landmark : landmarks) ids.push_back(landmark.id);
  const std::vector<Eigen::Matrix2d> marginals = map.graph.covariances(ids);
  const std::vector<Eigen::Matrix2d> others = by_their_nodes(ids, marginals, map);

  const auto origin_T_first = map.trajectory.origin_T_first();
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const StoredLandmark& stored = map.landmarks.at(ids[i]);
    model::MapLandmark& told = landmarks[i];
    const bool is_solved = !marginals[i].isZero(0.0);
    const bool is_given = stored.is_given();
    if (!is_solved && is_given) {
      told.covariance_m2 = stored.prior_covariance;
      continue;
    }
    told.covariance_m2 = is_solved ? marginals[i] : others[i];

    // A given map has its own origin and scale.
    if (is_given) continue;
    told.covariance_m2 += common.covariance_of(told.position_m);
    if (origin_T_first) {
      told.covariance_m2 +=
          point_covariance(*origin_T_first, origin_T_first->mean.inverse() * told.position_m);
    }
  }
}

std::vector<model::MapLandmark> told_landmarks(const GlobalMap& map, const CommonError& common) {
  std::vector<model::MapLandmark> result = map.all_landmarks();
  set_covariances(result, map, common);
  return result;
}

std::vector<model::KeyframePose> told_poses(const GlobalMap& map, const CommonError& common) {
  std::vector<model::KeyframePose> result = map.all_poses();
  std::vector<NodeIndex> nodes;
  nodes.reserve(result.size());
  for (const Base& base : map.trajectory.bases()) nodes.push_back(base.node);
  const std::vector<Eigen::Matrix3d> marginals = map.graph.covariances(nodes);

  for (std::size_t i = 0; i < result.size(); ++i) {
    const Base& base = map.trajectory.bases()[i];
    if (base.is_origin) continue;
    const geometry::SE2WithCovariance map_T_centre =
        map.trajectory.from_origin({map.graph.pose(base.node), marginals[i]});
    result[i].covariance = compound(map_T_centre, base.centre_T_base).covariance +
                           common.covariance_at(result[i].map_T_vehicle);
  }
  return result;
}

}  // namespace understory::geoslam_mapper::smoothing
