// Dormant landmarks: their information on the nodes as motions between these.
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "services/geoslam_mapper/smoothing/pose_graph.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

namespace plane = factor_graph::plane;

/// Steps of Gauss-Newton for a motion that starts at the present estimate.
constexpr int kSteps = 2;
/// Directions with less than this share of the largest information are undetermined.
constexpr double kUndetermined = 1e-6;
/// Assumed distance [m] of landmarks from their node.
constexpr double kLever_m = 40.0;

/// The minimum-norm solution if the information leaves directions undetermined.
Eigen::Vector3d solution(const Eigen::Matrix3d& information, const Eigen::Vector3d& gradient) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(information);
  Eigen::Vector3d inverse = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const double value = solver.eigenvalues()[k];
    if (value > kUndetermined * solver.eigenvalues()[2]) inverse[k] = 1.0 / value;
  }
  return solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose() *
         gradient;
}

/// One landmark's measurement of the motion between two nodes, all in the first node's frame except
/// `z_b`.
struct Shared {
  Eigen::Vector2d z_a = Eigen::Vector2d::Zero();
  Eigen::Vector2d z_b = Eigen::Vector2d::Zero();
  Eigen::Matrix2d weight = Eigen::Matrix2d::Zero();
};

}  // namespace

void PoseGraph::make_dormant(std::span<const model::LandmarkId> ids,
                             const std::map<model::LandmarkId, StoredLandmark>& landmarks) {
  std::set<TiedNodes> changed;
  for (const model::LandmarkId id : ids) {
    // Removes its observations.
    std::vector<DormantObservation>& observed = dormant_[id];
    for (const NodeIndex node : landmarks.at(id).nodes) {
      const auto entry = nodes_[node].observations().find(id);
      if (entry == nodes_[node].observations().end()) continue;
      const plane::PointObservation& factor = smoother_.observation(entry->second);
      observed.push_back({node, factor.position, factor.information});
      ignore(node, id);
      dormant_of_node_[node].landmarks.push_back(id);
    }

    // Removes the landmark itself.
    const auto point = point_of_.find(id);
    landmark_of_point_[index(point->second)] = 0;
    if (smoother_.is_free(point->second)) free_points_.give(index(point->second));
    point_of_.erase(point);
    for (const TiedNodes& nodes : tied_by(id)) {
      ties_[nodes].landmarks.push_back(id);
      changed.insert(nodes);
    }
  }
  renew(changed);
}

void PoseGraph::wake(std::span<const model::LandmarkId> ids) {
  std::set<TiedNodes> changed;
  for (const model::LandmarkId id : ids) {
    const auto found = dormant_.find(id);
    if (found == dormant_.end()) continue;
    for (const TiedNodes& nodes : tied_by(id)) {
      std::erase(ties_.at(nodes).landmarks, id);
      changed.insert(nodes);
    }
    add_landmark(id, dormant_position(id), std::nullopt);
    for (const DormantObservation& one : found->second) {
      place_observation(
          one.node, id,
          {nodes_[one.node].centre, point_of_.at(id), one.position_m, one.information});
      wakes(one.node, id);
    }
    dormant_.erase(found);
  }
  renew(changed);
}

std::vector<model::LandmarkId> PoseGraph::awake() const {
  std::vector<model::LandmarkId> ids;
  ids.reserve(point_of_.size());
  for (const auto& [id, point] : point_of_) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  return ids;
}

std::vector<PoseGraph::TiedNodes> PoseGraph::tied_by(model::LandmarkId id) const {
  const std::vector<DormantObservation>& observed = dormant_.at(id);
  std::vector<TiedNodes> result;
  result.reserve(observed.size() * observed.size() / 2);
  for (std::size_t i = 0; i < observed.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k)
      result.emplace_back(std::minmax(observed[i].node, observed[k].node));
  }
  return result;
}

/// Recomputes the motions of these ties after their landmarks changed.
void PoseGraph::renew(const std::set<TiedNodes>& ties) {
  for (const TiedNodes& nodes : ties) {
    const auto entry = ties_.find(nodes);
    Tie& one = entry->second;
    if (one.landmarks.empty() && one.submaps == 0) {
      if (one.motion) take_out(*one.motion);
      ties_.erase(entry);
      continue;
    }

    plane::RelativePose factor{nodes_[nodes.first].centre, nodes_[nodes.second].centre,
                               one.away.a_T_b, one.away.information};
    if (!one.landmarks.empty()) {
      factor = tie(nodes, one.landmarks);
      if (one.submaps > 0) {
        const MeasuredMotion sum = fused(one.away, {factor.a_T_b, factor.information});
        factor.a_T_b = sum.a_T_b;
        factor.information = sum.information;
      }
    }
    if (one.motion) {
      smoother_.set(*one.motion, factor);
    } else {
      one.motion = put(factor);
    }
  }
}

plane::MotionId PoseGraph::put(const plane::RelativePose& motion) {
  const auto number = free_motions_.take();
  if (!number) return smoother_.add(motion);
  smoother_.set(plane::MotionId(*number), motion);
  return plane::MotionId(*number);
}

void PoseGraph::take_out(plane::MotionId motion) {
  plane::RelativePose nothing = smoother_.motion(motion);
  nothing.information.setZero();
  smoother_.set(motion, nothing);
  free_motions_.give(index(motion));
}

/// Eliminating a point that two nodes observed with information A and B leaves the difference of
/// the two observations, with weight A (A + B)^-1 B. For a point with more observers the weight is
/// scaled by the share of A and B in the sum of all: exact for isotropic informations.
plane::RelativePose PoseGraph::tie(const TiedNodes& nodes,
                                   std::span<const model::LandmarkId> ids) const {
  const auto& [a, b] = nodes;
  const geometry::SE2 a_T_b = pose(a).inverse() * pose(b);
  const Eigen::Matrix2d to_a = a_T_b.rotation();
  std::vector<Shared> shared;
  shared.reserve(ids.size());
  for (const model::LandmarkId id : ids) {
    Shared one;
    double sum = 0.0;
    Eigen::Matrix2d of_a = Eigen::Matrix2d::Zero();
    Eigen::Matrix2d of_b = Eigen::Matrix2d::Zero();
    for (const DormantObservation& observed : dormant_.at(id)) {
      sum += observed.information.trace();
      if (observed.node == a) {
        of_a = observed.information;
        one.z_a = observed.position_m;
      } else if (observed.node == b) {
        of_b = to_a * observed.information * to_a.transpose();
        one.z_b = observed.position_m;
      }
    }
    const double share = (of_a + of_b).trace() / sum;
    const Eigen::Matrix2d weight = share * of_a * (of_a + of_b).inverse() * of_b;
    one.weight = 0.5 * (weight + weight.transpose());
    shared.push_back(one);
  }

  plane::RelativePose result{nodes_[a].centre, nodes_[b].centre, a_T_b, Eigen::Matrix3d::Zero()};
  for (int step = 0; step < kSteps; ++step) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    const Eigen::Matrix2d rotation = result.a_T_b.rotation();
    for (const Shared& one : shared) {
      Eigen::Matrix<double, 2, 3> j;
      j << rotation, rotation * geometry::perpendicular(one.z_b);
      normal += j.transpose() * one.weight * j;
      gradient += j.transpose() * one.weight * (one.z_a - result.a_T_b * one.z_b);
    }
    result.information = 0.5 * (normal + normal.transpose());
    result.a_T_b = result.a_T_b * geometry::SE2::Exp(solution(result.information, gradient));
  }
  return result;
}

/// Removes the landmark from the node's dormant ones.
void PoseGraph::wakes(NodeIndex node, model::LandmarkId id) {
  const auto found = dormant_of_node_.find(node);
  std::erase(found->second.landmarks, id);
  if (found->second.landmarks.empty()) dormant_of_node_.erase(found);
}

/// Whether the node has moved so far that its dormant landmarks must follow; then records its pose.
bool PoseGraph::has_left(NodeIndex node) {
  const auto found = dormant_of_node_.find(node);
  if (found == dormant_of_node_.end()) return false;
  const geometry::SE2 now = pose(node);
  const geometry::SE2& then = found->second.followed;
  const double moved_m = (now.translation() - then.translation()).norm();
  const double rotated = std::abs(geometry::wrap_angle(now.theta() - then.theta()));
  if (moved_m + kLever_m * rotated < kDormantMove_m) return false;
  found->second.followed = now;
  return true;
}

/// Mean of the positions by its observers.
Eigen::Vector2d PoseGraph::dormant_position(model::LandmarkId id) const {
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  Eigen::Vector2d weighted = Eigen::Vector2d::Zero();
  for (const DormantObservation& one : dormant_.at(id)) {
    const geometry::SE2 map_T_node = pose(one.node);
    const Eigen::Matrix2d rotation = map_T_node.rotation();
    const Eigen::Matrix2d information = rotation * one.information * rotation.transpose();
    sum += information;
    weighted += information * (rotation * one.position_m + map_T_node.translation());
  }
  return sum.inverse() * weighted;
}

}  // namespace understory::geoslam_mapper::smoothing
