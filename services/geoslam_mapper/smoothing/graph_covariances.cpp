// Covariances of many nodes and landmarks at once.
#include <Eigen/Eigenvalues>
#include <algorithm>

#include "services/geoslam_mapper/smoothing/pose_graph.hpp"

namespace understory::geoslam_mapper::smoothing {

namespace plane = factor_graph::plane;

std::vector<Eigen::Matrix2d> PoseGraph::covariances(std::span<const model::LandmarkId> ids) const {
  std::vector<plane::PointId> points;
  std::vector<std::size_t> place_of;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const auto found = point_of_.find(ids[i]);
    if (found == point_of_.end()) continue;
    points.push_back(found->second);
    place_of.push_back(i);
  }

  std::vector<Eigen::Matrix2d> result(ids.size(), Eigen::Matrix2d::Zero());
  const plane::Marginals marginals = smoother_.marginals({}, points);
  const Eigen::Matrix3d anchor = anchor_covariance();
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (marginals.points[k].isZero(0.0)) continue;
    result[place_of[k]] = marginals.points[k] + of_anchor(smoother_.point(points[k]), anchor);
  }
  return result;
}

std::vector<Eigen::Matrix3d> PoseGraph::covariances(std::span<const NodeIndex> nodes) const {
  std::vector<NodeIndex> distinct(nodes.begin(), nodes.end());
  std::sort(distinct.begin(), distinct.end());
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  std::vector<plane::PoseId> poses;
  poses.reserve(distinct.size());
  for (const NodeIndex node : distinct) poses.push_back(nodes_[node].centre);
  const plane::Marginals marginals = smoother_.marginals(poses, {});
  const Eigen::Matrix3d anchor = anchor_covariance();

  std::vector<Eigen::Matrix3d> result;
  result.reserve(nodes.size());
  for (const NodeIndex node : nodes) {
    const auto at = std::lower_bound(distinct.begin(), distinct.end(), node) - distinct.begin();
    Eigen::Matrix3d covariance = marginals.poses[static_cast<std::size_t>(at)];
    if (!covariance.isZero(0.0)) covariance += of_anchor(pose(node), anchor);
    result.push_back(covariance);
  }
  return result;
}

/// Contribution of the holding node's uncertainty to the covariance around the newest node: the sum
/// of both is exact there. It is less than the holding node's own covariance, since other factors
/// tie both sides of that node to each other.
Eigen::Matrix3d PoseGraph::anchor_covariance() const {
  if (!is_held_elsewhere()) return Eigen::Matrix3d::Zero();
  const plane::PoseId centre = nodes_[*newest_].centre;
  const auto relative = smoother_.joint_marginal({&centre, 1}, {});
  if (!relative) return Eigen::Matrix3d::Zero();

  const Eigen::Matrix3d adjoint = (anchor_->map_T_node.inverse() * pose(*newest_)).Adjoint();
  const Eigen::Matrix3d added =
      adjoint * (marginal(*newest_).covariance - *relative) * adjoint.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(0.5 * (added + added.transpose()));
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).asDiagonal() *
         solver.eigenvectors().transpose();
}

/// The holding node's covariance, transported to a node.
Eigen::Matrix3d PoseGraph::of_anchor(const geometry::SE2& map_T_node,
                                     const Eigen::Matrix3d& anchor) const {
  if (anchor.isZero(0.0)) return anchor;
  const Eigen::Matrix3d adjoint = (map_T_node.inverse() * anchor_->map_T_node).Adjoint();
  return adjoint * anchor * adjoint.transpose();
}

/// Likewise to a point, frame `map`.
Eigen::Matrix2d PoseGraph::of_anchor(const Eigen::Vector2d& position_m,
                                     const Eigen::Matrix3d& anchor) const {
  if (anchor.isZero(0.0)) return Eigen::Matrix2d::Zero();
  const Eigen::Matrix2d rotation = anchor_->map_T_node.rotation();
  Eigen::Matrix<double, 2, 3> jacobian;  // d(point)/d(right perturbation of the anchor)
  jacobian << rotation,
      rotation * geometry::perpendicular(anchor_->map_T_node.inverse() * position_m);
  return jacobian * anchor * jacobian.transpose();
}

}  // namespace understory::geoslam_mapper::smoothing
