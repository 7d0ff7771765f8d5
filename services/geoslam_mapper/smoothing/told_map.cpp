#include "services/geoslam_mapper/smoothing/told_map.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Covariance of a point of frame b in the axes of frame a.
Eigen::Matrix2d point_covariance(const geometry::SE2WithCovariance& a_T_b,
                                 const Eigen::Vector2d& in_b) {
  Eigen::Matrix<double, 2, 3> jacobian;  // d(point)/d(xi), in the axes of b
  jacobian << 1.0, 0.0, -in_b.y(), 0.0, 1.0, in_b.x();
  const Eigen::Matrix2d rotation = a_T_b.mean.rotation();
  return rotation * jacobian * a_T_b.covariance * jacobian.transpose() * rotation.transpose();
}

/// Of a landmark that the graph was not solved with yet: by the node that observed it.
Eigen::Matrix2d by_its_node(const StoredLandmark& landmark, const GlobalMap& map) {
  const geometry::SE2WithCovariance map_T_node = map.graph.marginal(landmark.nodes.back());
  return point_covariance(map_T_node, map_T_node.mean.inverse() * landmark.position_m) +
         landmark.local_variance() * Eigen::Matrix2d::Identity();
}

}  // namespace

void set_covariances(std::span<model::MapLandmark> landmarks, const GlobalMap& map,
                     const CommonError& common) {
  std::vector<model::LandmarkId> ids;
  ids.reserve(landmarks.size());
  for (const model::MapLandmark& landmark : landmarks) ids.push_back(landmark.id);
  const std::vector<Eigen::Matrix2d> marginals = map.graph.covariances(ids);

  const auto origin_T_first = map.trajectory.origin_T_first();
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const StoredLandmark& stored = map.landmarks.at(ids[i]);
    model::MapLandmark& told = landmarks[i];
    const bool is_solved = !marginals[i].isZero(0.0);
    const bool is_given = !stored.prior_covariance.isZero(0.0);
    if (!is_solved && is_given) {
      told.covariance_m2 = stored.prior_covariance;
      continue;
    }
    told.covariance_m2 = is_solved ? marginals[i] : by_its_node(stored, map);

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
