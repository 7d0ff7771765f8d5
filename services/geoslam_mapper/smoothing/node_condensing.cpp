// Condenses nodes of the graph into one.
#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <utility>

#include "common/factor_graph/plane/condense.hpp"
#include "common/geometry/decompositions.hpp"
#include "services/geoslam_mapper/smoothing/pose_graph.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

namespace plane = factor_graph::plane;

plane::PoseId pose_at(std::size_t i) { return plane::PoseId(static_cast<std::uint32_t>(i)); }

}  // namespace

void PoseGraph::condense_ahead(std::span<const NodeIndex> nodes) {
  Part part = part_of(nodes);
  auto condensed = plane::condense(part.graph, part.inner.size());
  ahead_.reset();
  if (condensed) ahead_ = CondensedAhead{std::move(part), *std::move(condensed)};
}

std::vector<Retirement> PoseGraph::condense(std::span<const NodeIndex> nodes) {
  if (!ahead_ || !std::ranges::equal(ahead_->part.inner, nodes)) condense_ahead(nodes);
  if (!ahead_) return {};
  const CondensedAhead ahead = *std::exchange(ahead_, std::nullopt);
  const Part& part = ahead.part;
  const plane::CondensedPart* const condensed = &ahead.condensed;

  // Adds the new node before the others are removed: its number differs from theirs.
  const double along_m = nodes_[part.inner[part.inner.size() / 2]].along_m;
  const NodeIndex into = put_node(condensed->map_T_origin, false, along_m);
  double keyframes = 0.0;
  for (const NodeIndex node : part.inner) keyframes += nodes_[node].keyframes;
  edit(into).keyframes = keyframes;
  edit(into).is_condensed = true;
  for (std::size_t i = 0; i < part.outer.size(); ++i)
    begin_motion_at(into, part.outer[i], condensed->outer[i]);
  for (const NodeIndex node : part.inner) take_out(node);

  // Their observations.
  for (std::size_t i = 0; i < part.landmarks.size(); ++i) {
    const plane::CondensedPoint& point = condensed->points[i];
    observe(into, part.landmarks[i], point.position, point.covariance.inverse());
  }
  if (condensed->bias_information > 0.0) {
    const plane::ScalarId bias = part.scalars.back();
    gyro_.learned(bias, smoother_.scalar(bias) + condensed->bias_step, condensed->bias_information,
                  smoother_);
  }
  if (!part.scalars.empty()) gyro_.drop_idle(smoother_);

  std::vector<Retirement> retired;
  retired.reserve(part.inner.size());
  for (std::size_t i = 0; i < part.inner.size(); ++i)
    retired.push_back({part.inner[i], into, condensed->origin_T_inner[i]});
  return retired;
}

PoseGraph::Part PoseGraph::part_of(std::span<const NodeIndex> nodes) const {
  Part part;
  part.inner.assign(nodes.begin(), nodes.end());
  for (const NodeIndex node : nodes) part.graph.add_pose(pose(node));

  std::map<model::LandmarkId, plane::PointId> points;
  for (std::size_t i = 0; i < part.inner.size(); ++i) {
    for (const auto& [id, number] : nodes_[part.inner[i]].observations()) {
      plane::PointObservation factor = smoother_.observation(number);
      const auto [entry, is_new] = points.try_emplace(id);
      if (is_new) {
        entry->second = part.graph.add_point(smoother_.point(factor.point));
        part.landmarks.push_back(id);
      }
      factor.pose = pose_at(i);
      factor.point = entry->second;
      part.graph.observations.push_back(factor);
    }
  }
  for (const NodeIndex node : part.inner) add_motions_of(node, part);
  return part;
}

/// Motions that end at the node, and motions that leave the part.
void PoseGraph::add_motions_of(NodeIndex node, Part& part) const {
  const auto number_of = [&](NodeIndex one) {
    return static_cast<std::size_t>(std::find(part.inner.begin(), part.inner.end(), one) -
                                    part.inner.begin());
  };
  for (const MotionRef ref : nodes_[node].motions()) {
    const auto [from, to] = ends_of(ref);
    std::size_t a = number_of(from);
    std::size_t b = number_of(to);
    const bool is_inner = a < part.inner.size() && b < part.inner.size();
    if (is_inner && to != node) continue;
    if (!is_inner) {
      const NodeIndex other = from == node ? to : from;
      (from == node ? b : a) = part.graph.poses.size();
      part.graph.add_pose(pose(other));
      part.outer.push_back({other, node, ref});
    }
    add_motion(ref, pose_at(a), pose_at(b), part);
  }
}

void PoseGraph::add_motion(MotionRef ref, plane::PoseId a, plane::PoseId b, Part& part) const {
  if (!ref.is_biased) {
    plane::RelativePose factor = smoother_.motion(plane::MotionId(ref.number));
    factor.a = a;
    factor.b = b;
    part.graph.relative_poses.push_back(factor);
    return;
  }
  plane::BiasedRelativePose factor = smoother_.motion(plane::BiasedMotionId(ref.number));
  part.scalars.push_back(factor.bias);
  part.graph.scalars.push_back(smoother_.scalar(factor.bias));
  factor.bias = plane::ScalarId(static_cast<std::uint32_t>(part.scalars.size() - 1));
  factor.motion.a = a;
  factor.motion.b = b;
  part.graph.biased_relative_poses.push_back(factor);
}

/// Replaces a motion between an outer node and a node of the part by one between the outer node and
/// `into`.
void PoseGraph::begin_motion_at(NodeIndex into, const Part::Outer& outer,
                                const plane::CondensedMotion& condensed) {
  const bool is_forward = ends_of(outer.motion).first == outer.inner;
  const geometry::SE2WithCovariance motion =
      is_forward ? condensed.origin_T_outer : inverse(condensed.origin_T_outer);
  plane::RelativePose measured{nodes_[into].centre, nodes_[outer.node].centre, motion.mean,
                               geometry::symmetric_inverse(motion.covariance)};
  if (!is_forward) std::swap(measured.a, measured.b);

  if (outer.motion.is_biased) {
    // The motion with the present bias subtracted.
    const auto id = plane::BiasedMotionId(outer.motion.number);
    const plane::ScalarId bias = smoother_.motion(id).bias;
    const double seconds = is_forward ? condensed.seconds : -condensed.seconds;
    measured.a_T_b = plane::at_true_rate(measured.a_T_b, -smoother_.scalar(bias), seconds);
    smoother_.set(id, plane::BiasedRelativePose{measured, bias, seconds});
  } else {
    smoother_.set(plane::MotionId(outer.motion.number), measured);
  }
  std::erase(edit(outer.inner).edit_motions(), outer.motion);
  edit(into).edit_motions().push_back(outer.motion);
}

/// Removes the node with its observations and its motions to others of its part.
void PoseGraph::take_out(NodeIndex node) {
  for (const auto& [id, number] : nodes_[node].observations()) {
    plane::PointObservation nothing = smoother_.observation(number);
    nothing.information.setZero();
    smoother_.set(number, nothing);
    free_observations_.give(index(number));
  }
  edit(node).edit_observations().clear();

  for (const MotionRef ref : std::exchange(edit(node).edit_motions(), {})) {
    const auto [from, to] = ends_of(ref);
    std::erase(edit(from == node ? to : from).edit_motions(), ref);
    take_motion_out(ref);
  }
  free_nodes_.give(node);
}

}  // namespace understory::geoslam_mapper::smoothing
