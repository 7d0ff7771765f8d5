#include "services/geoslam_mapper/smoothing/pose_graph.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <stdexcept>

#include "common/geometry/decompositions.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace plane = factor_graph::plane;

PoseGraph::PoseGraph(const SmoothingMapperParameters& parameters)
    : gyro_(parameters.gyro_walk, parameters.gyro_start_sigma) {}

void PoseGraph::checkpoint() {
  smoother_.checkpoint();
  before_ = Checkpoint{
      nodes_.size(), landmark_of_point_.size(), newest_, {}, closures_, origin_, anchor_, {}, {}};
  gyro_.checkpoint();
  for (FreeNumbers* free :
       {&free_nodes_, &free_points_, &free_observations_, &free_motions_, &free_biased_})
    free->checkpoint();
}

void PoseGraph::rollback() {
  ahead_.reset();
  smoother_.rollback();
  gyro_.rollback();
  for (FreeNumbers* free :
       {&free_nodes_, &free_points_, &free_observations_, &free_motions_, &free_biased_})
    free->rollback();

  for (std::size_t i = before_->points; i < landmark_of_point_.size(); ++i)
    point_of_.erase(landmark_of_point_[i]);
  landmark_of_point_.resize(before_->points);
  for (const plane::PointId point : before_->restarted) {
    point_of_.erase(landmark_of_point_[index(point)]);
    landmark_of_point_[index(point)] = 0;
  }
  for (const auto& [point, id] : before_->dropped) {
    landmark_of_point_[index(point)] = id;
    point_of_.emplace(id, point);
  }

  nodes_.resize(before_->nodes);
  for (auto& [node, was] : before_->changed) nodes_[node] = std::move(was);
  newest_ = before_->newest;
  closures_ = std::move(before_->closures);
  origin_ = before_->origin;
  anchor_ = before_->anchor;
  before_.reset();
}

/// The node for changes; its first change since the checkpoint saves its previous value.
Node& PoseGraph::edit(NodeIndex node) {
  forget_ahead_of(node);
  if (before_ && node < before_->nodes) before_->changed.try_emplace(node, nodes_[node]);
  return nodes_[node];
}

/// Drops the condensed measurement computed in advance if one of its nodes changes.
void PoseGraph::forget_ahead_of(NodeIndex node) {
  if (ahead_ && std::ranges::find(ahead_->part.inner, node) != ahead_->part.inner.end())
    ahead_.reset();
}

NodeIndex PoseGraph::add_node(const geometry::SE2& map_T_centre, bool is_stationary,
                              bool is_fixed) {
  const double driven_m =
      newest_ ? (map_T_centre.translation() - pose(*newest_).translation()).norm() : 0.0;
  const double along_m = newest_ ? nodes_[*newest_].along_m + driven_m : 0.0;

  newest_ = put_node(map_T_centre, is_stationary, along_m);
  if (is_fixed) {
    origin_ = Anchor{*newest_, map_T_centre};
    hold(*origin_);
  }
  return *newest_;
}

NodeIndex PoseGraph::put_node(const geometry::SE2& map_T_centre, bool is_stationary,
                              double along_m) {
  if (const auto number = free_nodes_.take()) {
    Node& node = edit(*number);
    smoother_.restart(node.centre, map_T_centre);
    node = Node(node.centre, is_stationary, along_m);
    return *number;
  }
  nodes_.emplace_back(smoother_.add_pose(map_T_centre), is_stationary, along_m);
  return static_cast<NodeIndex>(nodes_.size() - 1);
}

void PoseGraph::add_landmark(model::LandmarkId id, const Eigen::Vector2d& position_m,
                             const std::optional<Eigen::Matrix2d>& prior_covariance_m2) {
  plane::PointId point{};
  if (const auto number = free_points_.take()) {
    point = plane::PointId(*number);
    smoother_.restart(point, position_m);
    landmark_of_point_[*number] = id;
    if (before_ && *number < before_->points) before_->restarted.push_back(point);
  } else {
    point = smoother_.add_point(position_m);
    landmark_of_point_.push_back(id);
  }
  point_of_.emplace(id, point);
  if (prior_covariance_m2)
    smoother_.add(plane::PointPrior{point, position_m, prior_covariance_m2->inverse()});
}

void PoseGraph::place_observation(NodeIndex node, model::LandmarkId id,
                                  const plane::PointObservation& factor) {
  if (const auto number = free_observations_.take()) {
    smoother_.set(plane::ObservationId(*number), factor);
    edit(node).edit_observations().emplace(id, plane::ObservationId(*number));
  } else {
    edit(node).edit_observations().emplace(id, smoother_.add(factor));
  }
}

void PoseGraph::observe(NodeIndex node, model::LandmarkId id, const Eigen::Vector2d& position_m,
                        const Eigen::Matrix2d& information) {
  const auto entry = nodes_[node].observations().find(id);
  if (entry == nodes_[node].observations().end()) {
    place_observation(node, id, {nodes_[node].centre, point_of_.at(id), position_m, information});
    return;
  }

  forget_ahead_of(node);
  plane::PointObservation factor = smoother_.observation(entry->second);
  const Eigen::Matrix2d sum = factor.information + information;
  factor.position =
      sum.inverse() * (factor.information * factor.position + information * position_m);
  factor.information = sum;
  smoother_.set(entry->second, factor);
}

void PoseGraph::ignore(NodeIndex node, model::LandmarkId id) {
  auto& observations = edit(node).edit_observations();
  const auto entry = observations.find(id);
  plane::PointObservation nothing = smoother_.observation(entry->second);
  nothing.information.setZero();
  smoother_.set(entry->second, nothing);
  free_observations_.give(index(entry->second));
  observations.erase(entry);
}

std::vector<HandedOver> PoseGraph::hand_over(model::LandmarkId old_id, model::LandmarkId new_id,
                                             std::span<const NodeIndex> nodes) {
  std::vector<HandedOver> result;
  const plane::PointId new_point = point_of_.at(new_id);
  for (const NodeIndex node : nodes) {
    auto& observations = edit(node).edit_observations();
    auto handle = observations.extract(old_id);
    if (handle.empty()) continue;

    // A node that observed both keeps only its observation of the remaining landmark.
    plane::PointObservation factor = smoother_.observation(handle.mapped());
    const bool counts = !observations.contains(new_id);
    result.push_back({node, factor.position, factor.information, counts});
    factor.point = new_point;
    if (!counts) factor.information.setZero();
    smoother_.set(handle.mapped(), factor);
    if (!counts) {
      free_observations_.give(index(handle.mapped()));
      continue;
    }

    handle.key() = new_id;
    observations.insert(std::move(handle));
  }

  const auto old_point = point_of_.find(old_id);
  landmark_of_point_[index(old_point->second)] = 0;
  if (before_ && index(old_point->second) < before_->points)
    before_->dropped.emplace_back(old_point->second, old_id);
  if (smoother_.is_free(old_point->second)) free_points_.give(index(old_point->second));
  point_of_.erase(old_point);
  return result;
}

std::vector<NodeIndex> PoseGraph::give_back(model::LandmarkId from_id, model::LandmarkId to_id,
                                            std::span<const HandedOver> handed_over) {
  std::vector<NodeIndex> nodes;
  const plane::PointId to_point = point_of_.at(to_id);
  for (const HandedOver& one : handed_over) {
    if (!one.counts) {
      observe(one.node, to_id, one.position_m, one.information);
      nodes.push_back(one.node);
      continue;
    }

    const auto entry = nodes_[one.node].observations().find(from_id);
    if (entry == nodes_[one.node].observations().end()) continue;
    plane::PointObservation factor = smoother_.observation(entry->second);
    if (factor.position != one.position_m || factor.information != one.information) continue;
    factor.point = to_point;
    smoother_.set(entry->second, factor);

    auto& observations = edit(one.node).edit_observations();
    auto handle = observations.extract(from_id);
    handle.key() = to_id;
    observations.insert(std::move(handle));
    nodes.push_back(one.node);
  }
  return nodes;
}

void PoseGraph::add_motion(const CentreMotion& motion, NodeIndex node) {
  if (motion.from == node) return;
  plane::RelativePose measured{nodes_[motion.from].centre, nodes_[node].centre,
                               motion.from_T_to.mean, Eigen::Matrix3d::Zero()};
  if (!gyro_.is_estimated() || !motion.gyro) {
    measured.information = geometry::symmetric_inverse(motion.from_T_to.covariance);
    link(measured, motion.from, node);
    return;
  }

  const plane::BiasedRelativePose biased = gyro_.biased(measured, motion, smoother_);
  const auto number = free_biased_.take();
  if (number) smoother_.set(plane::BiasedMotionId(*number), biased);
  const MotionRef ref{true, number ? *number : index(smoother_.add(biased))};
  edit(motion.from).edit_motions().push_back(ref);
  edit(node).edit_motions().push_back(ref);
}

MotionRef PoseGraph::link(const plane::RelativePose& measured, NodeIndex from, NodeIndex to) {
  const auto number = free_motions_.take();
  if (number) smoother_.set(plane::MotionId(*number), measured);
  const MotionRef ref{false, number ? *number : index(smoother_.add(measured))};
  edit(from).edit_motions().push_back(ref);
  edit(to).edit_motions().push_back(ref);
  return ref;
}

void PoseGraph::add_closure(std::uint64_t id, NodeIndex a, NodeIndex b,
                            const geometry::SE2WithCovariance& a_T_b) {
  const MotionRef ref = link({nodes_[a].centre, nodes_[b].centre, a_T_b.mean,
                              geometry::symmetric_inverse(a_T_b.covariance)},
                             a, b);
  closures_.emplace(ref.number, id);
}

void PoseGraph::take_closure_out(std::uint64_t id) {
  if (frozen_motions_.has_closure(id)) unfreeze();
  const MotionRef ref{false, motion_of(id)};
  const auto [a, b] = ends_of(ref);
  std::erase(edit(a).edit_motions(), ref);
  std::erase(edit(b).edit_motions(), ref);
  take_motion_out(ref);
}

bool PoseGraph::has_closure(std::uint64_t id) const {
  return std::ranges::any_of(closures_, [&](const auto& one) { return one.second == id; }) ||
         frozen_motions_.has_closure(id);
}

std::uint32_t PoseGraph::motion_of(std::uint64_t closure) const {
  return std::ranges::find_if(closures_, [&](const auto& one) { return one.second == closure; })
      ->first;
}

double PoseGraph::closure_chi2(std::uint64_t id) const {
  const plane::RelativePose& measured = smoother_.motion(plane::MotionId(motion_of(id)));
  const geometry::SE2 a_T_b = smoother_.pose(measured.a).inverse() * smoother_.pose(measured.b);
  const Eigen::Vector3d off = (measured.a_T_b.inverse() * a_T_b).coordinates();
  return off.dot(measured.information * off);
}

/// Condensed or woken parts are behind the vehicle: the next keyframe continues at the newest node.
plane::SmootherUpdate PoseGraph::solve() {
  ahead_.reset();
  if (newest_) smoother_.expect_changes_at(nodes_[*newest_].centre);
  return smoother_.update();
}

std::optional<Eigen::Vector2d> PoseGraph::position(model::LandmarkId id) const {
  const auto found = point_of_.find(id);
  if (found == point_of_.end()) return std::nullopt;
  return smoother_.point(found->second);
}

double PoseGraph::chi2(NodeIndex node, model::LandmarkId id) const {
  return smoother_.chi2(nodes_[node].observations().at(id));
}

geometry::SE2WithCovariance PoseGraph::marginal(NodeIndex node) const {
  geometry::SE2WithCovariance result{pose(node), Eigen::Matrix3d::Zero()};
  if (is_held_elsewhere()) {
    if (node == origin_->node) return result;
    if (const auto from_origin = relative(origin_->node, node))
      result.covariance = from_origin->covariance;
    return result;
  }

  const plane::PoseId centre = nodes_[node].centre;
  if (const auto covariance = smoother_.joint_marginal({&centre, 1}, {}))
    result.covariance = *covariance;
  return result;
}

std::optional<geometry::SE2WithCovariance> PoseGraph::relative(NodeIndex a, NodeIndex b) const {
  const plane::PoseId both[] = {nodes_[a].centre, nodes_[b].centre};
  const auto joint = smoother_.joint_marginal(both, {});
  if (!joint) return std::nullopt;
  const geometry::SE2 a_T_b = pose(a).inverse() * pose(b);
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian << -a_T_b.inverse().Adjoint(), Eigen::Matrix3d::Identity();
  return geometry::SE2WithCovariance{a_T_b, jacobian * *joint * jacobian.transpose()};
}

std::vector<double> PoseGraph::relative_variances(NodeIndex node,
                                                  std::span<const model::LandmarkId> ids) const {
  const plane::PoseId centre = nodes_[node].centre;
  std::vector<plane::PointId> points;
  points.reserve(ids.size());
  for (const model::LandmarkId id : ids) points.push_back(point_of_.at(id));

  std::vector<double> variances;
  const auto joint = smoother_.joint_marginal({&centre, 1}, points);
  if (!joint) return variances;

  const geometry::SE2 map_T_centre = smoother_.pose(centre);
  for (std::size_t i = 0; i < points.size(); ++i) {
    // d(landmark in the node's frame) / d(pose, landmark)
    const plane::ObservationJacobian j = plane::linearise(map_T_centre, smoother_.point(points[i]));
    const auto at = 3 + 2 * static_cast<Eigen::Index>(i);
    const Eigen::Matrix2d cross = j.pose * joint->block<3, 2>(0, at) * j.point.transpose();
    const Eigen::Matrix2d covariance = j.pose * joint->topLeftCorner<3, 3>() * j.pose.transpose() +
                                       j.point * joint->block<2, 2>(at, at) * j.point.transpose() +
                                       cross + cross.transpose();
    variances.push_back(0.5 * covariance.trace());
  }
  return variances;
}

std::optional<Eigen::Matrix2d> PoseGraph::difference_covariance(model::LandmarkId a,
                                                                model::LandmarkId b) const {
  const plane::PointId both[] = {point_of_.at(a), point_of_.at(b)};
  const auto joint = smoother_.joint_marginal({}, both);
  if (!joint) return std::nullopt;
  return Eigen::Matrix2d(joint->topLeftCorner<2, 2>() + joint->bottomRightCorner<2, 2>() -
                         joint->topRightCorner<2, 2>() - joint->bottomLeftCorner<2, 2>());
}

std::vector<std::pair<model::LandmarkId, Eigen::Vector2d>> PoseGraph::take_moved_landmarks() {
  std::vector<std::pair<model::LandmarkId, Eigen::Vector2d>> result;
  result.reserve(smoother_.moved_points().size());
  for (const plane::PointId point : smoother_.moved_points()) {
    const model::LandmarkId id = landmark_of_point_[index(point)];
    if (id != 0) result.emplace_back(id, smoother_.point(point));
  }

  // Dormant landmarks follow their nodes.
  std::vector<model::LandmarkId> dormant;
  for (const NodeIndex node : moved_nodes()) {
    if (!has_left(node)) continue;
    const std::span<const model::LandmarkId> ids = dormant_of(node);
    dormant.insert(dormant.end(), ids.begin(), ids.end());
  }
  std::sort(dormant.begin(), dormant.end());
  dormant.erase(std::unique(dormant.begin(), dormant.end()), dormant.end());
  for (const model::LandmarkId id : dormant) result.emplace_back(id, dormant_position(id));
  return result;
}

std::vector<NodeIndex> PoseGraph::moved_nodes() const {
  std::vector<NodeIndex> result;
  result.reserve(smoother_.moved_poses().size());
  for (const plane::PoseId pose : smoother_.moved_poses()) result.push_back(index(pose));
  return result;
}

void PoseGraph::restore(const plane::Graph& graph) {
  if (graph.poses.size() != nodes_.size() || graph.points.size() != landmark_of_point_.size())
    throw std::invalid_argument("mapper state: its graph does not fit its nodes");
  ahead_.reset();
  smoother_.start_from(graph);
  for (const NodeIndex node : frozen_.all()) smoother_.park(nodes_.at(node).centre);
  if (anchor_) hold(*anchor_);

  for (std::size_t i = 0; i < landmark_of_point_.size(); ++i) {
    if (landmark_of_point_[i] != 0)
      point_of_.emplace(landmark_of_point_[i], plane::PointId(static_cast<std::uint32_t>(i)));
  }
  recondense_frozen();
  dormant_of_node_.clear();
  for (const auto& [id, observed] : dormant_) {
    for (const DormantObservation& one : observed)
      dormant_of_node_[one.node].landmarks.push_back(id);
  }
}

}  // namespace understory::geoslam_mapper::smoothing
