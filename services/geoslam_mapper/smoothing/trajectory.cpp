#include "services/geoslam_mapper/smoothing/trajectory.hpp"

#include <cmath>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Two bases of a node are one viewpoint within this share of the folding distance and angle.
constexpr double kApartShare = 0.25;

}  // namespace

geometry::SE2 middle_of(const model::Keyframe& keyframe) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const geometry::SE2 base_T_centre = keyframe.centre_T_base().inverse();
  for (const model::KeyframeMember& member : keyframe.members)
    sum += (base_T_centre * member.centre_T_vehicle).coordinates();
  sum /= static_cast<double>(keyframe.members.size());
  return keyframe.centre_T_base() * geometry::SE2(sum.x(), sum.y(), sum.z());
}

Base base_of(const model::Keyframe& keyframe, NodeIndex node, bool is_origin) {
  return {node,
          keyframe.sequence,
          keyframe.utime,
          {keyframe.centre_T_base(), keyframe.members.front().covariance},
          middle_of(keyframe),
          is_origin};
}

void Trajectory::add(const Base& base, const PoseGraph& graph) {
  bases_.push_back(base);
  index(size() - 1, graph);
}

/// Makes the base a viewpoint unless its node has one as near.
void Trajectory::index(std::uint32_t number, const PoseGraph& graph) {
  const Base& base = bases_[number];
  if (viewpoints_of_node_.size() <= base.node) viewpoints_of_node_.resize(base.node + 1);
  std::vector<std::uint32_t>& viewpoints = viewpoints_of_node_[base.node];

  const double apart_m = kApartShare * fold_distance_m_;
  for (const std::uint32_t other : viewpoints) {
    const geometry::SE2 between =
        bases_[viewpoints_[other]].centre_T_middle.inverse() * base.centre_T_middle;
    if (between.translation().norm() < apart_m &&
        std::abs(between.theta()) < kApartShare * fold_angle_rad_) {
      return;
    }
  }

  viewpoints.push_back(static_cast<std::uint32_t>(viewpoints_.size()));
  viewpoints_.push_back(number);
  grid_.put(viewpoints.back(), middle(base, graph).translation());
}

void Trajectory::follow(const PoseGraph& graph) {
  for (const NodeIndex node : graph.moved_nodes()) {
    if (node >= viewpoints_of_node_.size()) continue;
    for (const std::uint32_t viewpoint : viewpoints_of_node_[node])
      grid_.put(viewpoint, middle(bases_[viewpoints_[viewpoint]], graph).translation());
  }
}

geometry::SE2 Trajectory::pose(const Base& base, const PoseGraph& graph) const {
  if (base.is_origin) return {};
  return graph.pose(base.node) * base.centre_T_base.mean;
}

bool Trajectory::is_stationary(const model::Keyframe& keyframe) const {
  const geometry::SE2 driven = keyframe.members.front().centre_T_vehicle.inverse() *
                               keyframe.members.back().centre_T_vehicle;
  return driven.translation().norm() < fold_distance_m_ &&
         std::abs(driven.theta()) < fold_angle_rad_;
}

std::optional<NodeIndex> Trajectory::revisited(const geometry::SE2& map_T_middle,
                                               const PoseGraph& graph) const {
  std::optional<NodeIndex> best;
  double best_distance = fold_distance_m_;
  grid_.for_each_near(map_T_middle.translation(), best_distance, [&](std::uint32_t viewpoint) {
    const Base& base = bases_[viewpoints_[viewpoint]];
    const geometry::SE2 between = middle(base, graph).inverse() * map_T_middle;
    const double distance = between.translation().norm();
    const bool is_nearer =
        distance < best_distance || (distance == best_distance && best < base.node);
    if (!is_nearer || std::abs(between.theta()) > fold_angle_rad_) return;

    best = base.node;
    best_distance = distance;
  });
  return best;
}

geometry::SE2WithCovariance Trajectory::centre_from_origin(NodeIndex node,
                                                           const PoseGraph& graph) const {
  const geometry::SE2WithCovariance map_T_centre = graph.marginal(node);
  if (!bases_.front().is_origin) return map_T_centre;
  const geometry::SE2WithCovariance origin_T_first = inverse(bases_.front().centre_T_base);
  return compound(origin_T_first,
                  {origin_T_first.mean.inverse() * map_T_centre.mean, map_T_centre.covariance});
}

void Trajectory::rebuild_index(const PoseGraph& graph) {
  viewpoints_.clear();
  viewpoints_of_node_.clear();
  grid_ = {};
  for (std::uint32_t number = 0; number < size(); ++number) {
    (void)graph.node(bases_[number].node);  // Throws where the graph has no such node.
    index(number, graph);
  }
}

}  // namespace understory::geoslam_mapper::smoothing
