// Removes nodes for which another node takes over.
#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include "common/geometry/decompositions.hpp"
#include "services/geoslam_mapper/smoothing/pose_graph.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

namespace plane = factor_graph::plane;

/// Whether the node stays and is tied to the one before it.
bool stays_tied(NodeIndex node, const Surplus& surplus) {
  return std::none_of(surplus.nodes.begin(), surplus.nodes.end(),
                      [&](const Retirement& one) { return one.node == node; }) &&
         std::find(surplus.loose.begin(), surplus.loose.end(), node) == surplus.loose.end();
}

}  // namespace

void PoseGraph::take_out(const Surplus& surplus) {
  const auto bias = gyro_.estimate(smoother_);
  const std::size_t biased_before = free_biased_.size();

  for (const Retirement& one : surplus.nodes) hand_observations_to(one);
  for (const Retirement& one : surplus.nodes) take_motions_out(one, surplus);
  for (const NodeIndex node : surplus.loose) loosen(node, surplus);
  for (const auto& [a, b] : surplus.motions) take_motions_out(a, b);
  for (const Retirement& one : surplus.nodes) free_nodes_.give(one.node);

  if (bias && free_biased_.size() != biased_before) gyro_.keep(*bias, smoother_);
}

/// The covariance of each observation includes that of the relative pose of the two nodes. Adding
/// up two nodes' full information is exact if both observed the same landmarks: information on a
/// node's pose is not information on the landmarks, and the other node is loose, too.
void PoseGraph::hand_observations_to(const Retirement& retirement) {
  Node& node = edit(retirement.node);
  const geometry::SE2& into_T_node = retirement.into_T_node.mean;
  const Eigen::Matrix2d rotation = into_T_node.rotation();

  for (const auto& [id, number] : node.observations()) {
    plane::PointObservation factor = smoother_.observation(number);
    const Eigen::Vector2d position = factor.position;
    Eigen::Matrix2d covariance = factor.information.inverse();
    factor.information.setZero();
    smoother_.set(number, factor);
    free_observations_.give(index(number));

    // d(landmark in the frame of `into`) / d(right perturbation of into_T_node)
    Eigen::Matrix<double, 2, 3> j;
    j << rotation, rotation * geometry::perpendicular(position);
    covariance = rotation * covariance * rotation.transpose() +
                 j * retirement.into_T_node.covariance * j.transpose();
    observe(retirement.into, id, into_T_node * position, covariance.inverse());
  }
  node.edit_observations().clear();
  edit(retirement.into).keyframes += node.keyframes;
}

void PoseGraph::take_motions_out(const Retirement& retirement, const Surplus& surplus) {
  for (const MotionRef ref : std::exchange(edit(retirement.node).edit_motions(), {})) {
    const plane::RelativePose measured = take_motion_out(ref);
    const NodeIndex from = index(measured.a);
    const NodeIndex to = index(measured.b);
    std::erase(edit(from == retirement.node ? to : from).edit_motions(), ref);
    if (leads_away(retirement.node, from, to, surplus)) {
      begin_motion_at(retirement, to, measured);
    } else if (leads_in(retirement.node, from, to, surplus)) {
      end_motion_at(retirement, from, measured);
    }
  }
}

/// Whether the motion goes from the node to a later one that stays tied.
bool PoseGraph::leads_away(NodeIndex node, NodeIndex from, NodeIndex to,
                           const Surplus& surplus) const {
  return from == node && stays_tied(to, surplus) && nodes_[to].along_m > nodes_[node].along_m;
}

/// Whether the motion, removed from `from`, comes from an earlier node that depends on its motions:
/// when the vehicle returns from unknown ground, this motion closes the loop. An earlier node
/// without other motions was made loose itself.
bool PoseGraph::leads_in(NodeIndex node, NodeIndex from, NodeIndex to,
                         const Surplus& surplus) const {
  return to == node && stays_tied(from, surplus) && !nodes_[from].motions().empty() &&
         nodes_[from].along_m < nodes_[node].along_m;
}

/// Keeps motions between the node and nodes that stay tied, removes the others.
void PoseGraph::loosen(NodeIndex node, const Surplus& surplus) {
  const std::vector<MotionRef> motions = nodes_[node].motions();
  for (const MotionRef ref : motions) {
    const auto [from, to] = ends_of(ref);
    if (leads_away(node, from, to, surplus)) continue;
    std::erase(edit(from).edit_motions(), ref);
    if (leads_in(node, from, to, surplus)) {
      edit(from).edit_motions().push_back(ref);
      continue;
    }
    std::erase(edit(to).edit_motions(), ref);
    take_motion_out(ref);
  }
}

std::pair<NodeIndex, NodeIndex> PoseGraph::ends_of(MotionRef ref) const {
  const plane::RelativePose& motion =
      ref.is_biased ? smoother_.motion(plane::BiasedMotionId(ref.number)).motion
                    : smoother_.motion(plane::MotionId(ref.number));
  return {index(motion.a), index(motion.b)};
}

void PoseGraph::take_motions_out(NodeIndex a, NodeIndex b) {
  const std::vector<MotionRef> motions = nodes_[a].motions();
  for (const MotionRef ref : motions) {
    if (std::find(nodes_[b].motions().begin(), nodes_[b].motions().end(), ref) ==
        nodes_[b].motions().end()) {
      continue;
    }
    std::erase(edit(a).edit_motions(), ref);
    std::erase(edit(b).edit_motions(), ref);
    take_motion_out(ref);
  }
}

/// Removes the motion and returns it with the present bias.
plane::RelativePose PoseGraph::take_motion_out(MotionRef ref) {
  if (!ref.is_biased) {
    plane::RelativePose measured = smoother_.motion(plane::MotionId(ref.number));
    plane::RelativePose nothing = measured;
    nothing.information.setZero();
    smoother_.set(plane::MotionId(ref.number), nothing);
    free_motions_.give(ref.number);
    closures_.erase(ref.number);
    return measured;
  }

  plane::BiasedRelativePose biased = smoother_.motion(plane::BiasedMotionId(ref.number));
  plane::RelativePose measured = biased.motion;
  measured.a_T_b =
      plane::at_true_rate(measured.a_T_b, smoother_.scalar(biased.bias), biased.seconds);
  biased.motion.information.setZero();
  smoother_.set(plane::BiasedMotionId(ref.number), biased);
  free_biased_.give(ref.number);
  gyro_.forget_motion(biased.bias);
  return measured;
}

void PoseGraph::begin_motion_at(const Retirement& retirement, NodeIndex to,
                                const plane::RelativePose& measured) {
  const geometry::SE2WithCovariance motion{measured.a_T_b,
                                           geometry::symmetric_inverse(measured.information)};
  const geometry::SE2WithCovariance into_T_to = compound(retirement.into_T_node, motion);
  link({nodes_[retirement.into].centre, nodes_[to].centre, into_T_to.mean,
        geometry::symmetric_inverse(into_T_to.covariance)},
       retirement.into, to);
}

void PoseGraph::end_motion_at(const Retirement& retirement, NodeIndex from,
                              const plane::RelativePose& measured) {
  const geometry::SE2WithCovariance motion{measured.a_T_b,
                                           geometry::symmetric_inverse(measured.information)};
  const geometry::SE2WithCovariance from_T_into = compound(motion, inverse(retirement.into_T_node));
  link({nodes_[from].centre, nodes_[retirement.into].centre, from_T_into.mean,
        geometry::symmetric_inverse(from_T_into.covariance)},
       from, retirement.into);
}

}  // namespace understory::geoslam_mapper::smoothing
