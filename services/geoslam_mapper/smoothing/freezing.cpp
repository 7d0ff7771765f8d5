// Frozen nodes, and their condensed measurements of other nodes.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "services/geoslam_mapper/smoothing/pose_graph.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

namespace plane = factor_graph::plane;

/// Most outer nodes of a frozen part: their joint measurement is dense.
constexpr std::size_t kMostOuter = 24;

}  // namespace

bool PoseGraph::may_freeze(NodeIndex node) const {
  return nodes_[node].is_condensed && nodes_[node].observations().empty() &&
         dormant_of(node).empty() && !frozen_.contains(node) && node != newest_ &&
         !(origin_ && node == origin_->node);
}

bool PoseGraph::freeze(std::span<const NodeIndex> nodes) {
  std::set<NodeIndex> going;
  for (const NodeIndex node : nodes)
    if (may_freeze(node)) going.insert(node);
  if (going.empty()) return false;
  std::optional<Anchor> next;
  if (origin_ && (!is_held_elsewhere() || going.contains(anchor_->node))) {
    next = anchor_beyond(going);
    if (!next) return false;
  }

  // Motions to the nodes around; parts frozen earlier are included as one measurement.
  const std::vector<FrozenMotion> theirs = motions_around(going);
  const auto fresh = condense_parts(parts_of(theirs, frozen_factors_, going));
  if (!fresh) return false;

  take_motions_out(going);
  for (const FrozenMotion& one : theirs) frozen_motions_.add(one);
  for (const NodeIndex node : going) frozen_.insert(node);
  std::erase_if(frozen_factors_, [&](const FrozenFactor& factor) {
    return std::ranges::any_of(factor.nodes, [&](NodeIndex node) { return going.contains(node); });
  });
  frozen_factors_.insert(frozen_factors_.end(), fresh->begin(), fresh->end());
  set_frozen_factors();
  gyro_.drop_idle(smoother_);
  if (next) hold(*next);
  for (const NodeIndex node : going) smoother_.park(nodes_[node].centre);
  return true;
}

/// Motions of the nodes among each other and to nodes around, each once, with the present bias.
std::vector<FrozenMotion> PoseGraph::motions_around(const std::set<NodeIndex>& nodes) const {
  std::vector<FrozenMotion> around;
  for (const NodeIndex node : nodes) {
    for (const MotionRef ref : nodes_[node].motions()) {
      const auto [from, to] = ends_of(ref);
      const NodeIndex other = from == node ? to : from;
      if (!nodes.contains(other) || node < other) around.push_back(loose_motion(ref));
    }
  }
  for (const auto& [ends, tie] : ties_)
    if (nodes.contains(ends.first) || nodes.contains(ends.second))
      around.push_back(away_motion(ends, tie));
  return around;
}

/// Removes those motions from the solved graph.
void PoseGraph::take_motions_out(const std::set<NodeIndex>& nodes) {
  for (const NodeIndex node : nodes) {
    for (const MotionRef ref : std::exchange(edit(node).edit_motions(), {})) {
      const auto [from, to] = ends_of(ref);
      std::erase(edit(from == node ? to : from).edit_motions(), ref);
      take_motion_out(ref);
    }
    edit(node).give_room_back();
  }
  std::erase_if(ties_, [&](const auto& one) {
    const auto& [ends, tie] = one;
    if (!nodes.contains(ends.first) && !nodes.contains(ends.second)) return false;
    take_out(*tie.motion);
    return true;
  });
}

bool PoseGraph::thaw(std::span<const NodeIndex> nodes) {
  if (std::ranges::none_of(nodes, [&](NodeIndex node) { return frozen_.contains(node); }))
    return false;
  for (const NodeIndex node : nodes) release(node);
  give_back(frozen_motions_.take_beyond(frozen_));
  recondense_frozen();
  return true;
}

/// Makes a frozen node a variable again.
void PoseGraph::release(NodeIndex node) {
  if (frozen_.erase(node)) smoother_.unpark(nodes_[node].centre);
}

/// No measurement may be lost: a part that cannot be condensed returns to the solved graph.
void PoseGraph::recondense_frozen() {
  const std::set<NodeIndex> frozen = frozen_.all();
  auto factors = condense_parts(parts_of(frozen_motions_.all(), {}, frozen));
  if (!factors) {
    for (const NodeIndex node : frozen) release(node);
    give_back(frozen_motions_.take_beyond({}));
    factors.emplace();
  }
  frozen_factors_ = *std::move(factors);
  set_frozen_factors();
}

/// Returns motions without a frozen end to the solved graph.
void PoseGraph::give_back(std::span<const FrozenMotion> motions) {
  std::set<TiedNodes> tied;
  for (const FrozenMotion& one : motions) {
    if (one.away > 0) {
      add_away(one);
      tied.emplace(one.a, one.b);
      continue;
    }
    const MotionRef ref = link(
        {nodes_[one.a].centre, nodes_[one.b].centre, one.a_T_b, one.information}, one.a, one.b);
    if (one.closure != 0) closures_.emplace(ref.number, one.closure);
  }
  renew(tied);
}

/// None if a part does not determine its nodes, or has too many outer nodes.
std::optional<std::vector<FrozenFactor>> PoseGraph::condense_parts(
    const std::vector<FrozenPart>& parts) const {
  std::vector<FrozenFactor> factors;
  for (const FrozenPart& part : parts) {
    if (part.outer.size() > kMostOuter) return std::nullopt;
    if (part.outer.size() < 2) continue;
    auto one = condensed(part, [&](NodeIndex node) { return pose(node); });
    if (!one) return std::nullopt;
    factors.push_back(*std::move(one));
  }
  return factors;
}

void PoseGraph::set_frozen_factors() {
  std::vector<plane::CondensedPoses> measured;
  for (const FrozenFactor& factor : frozen_factors_) {
    plane::CondensedPoses& one = measured.emplace_back(factor.measured);
    for (const NodeIndex node : factor.nodes) one.poses.push_back(nodes_[node].centre);
  }
  smoother_.set_condensed(measured);
}

void PoseGraph::unfreeze() {
  const std::set<NodeIndex> all = frozen_.all();
  thaw(std::vector<NodeIndex>(all.begin(), all.end()));
  if (origin_ && anchor_->node != origin_->node) hold(*origin_);
}

std::optional<NodeIndex> PoseGraph::origin() const {
  return origin_ ? std::optional(origin_->node) : std::nullopt;
}

bool PoseGraph::move_origin(const Eigen::Vector2d& by_m) {
  if (!origin_ || is_held_elsewhere()) return false;
  origin_->map_T_node =
      geometry::SE2(origin_->map_T_node.translation() + by_m, origin_->map_T_node.theta());
  hold(*origin_);
  return true;
}

void PoseGraph::hold(const Anchor& anchor) {
  anchor_ = anchor;
  smoother_.hold(nodes_[anchor.node].centre, anchor.map_T_node);
}

/// The condensed node of the solved graph that is nearest on the path to the nodes that leave it.
std::optional<Anchor> PoseGraph::anchor_beyond(const std::set<NodeIndex>& going) const {
  double last_m = -std::numeric_limits<double>::infinity();
  for (const NodeIndex node : going) last_m = std::max(last_m, nodes_[node].along_m);
  const std::set<std::uint32_t> free(free_nodes_.numbers().begin(), free_nodes_.numbers().end());

  std::optional<NodeIndex> nearest;
  double least_m = std::numeric_limits<double>::infinity();
  for (NodeIndex node = 0; node < nodes_.size(); ++node) {
    const double distance_m = std::abs(nodes_[node].along_m - last_m);
    const bool stays = nodes_[node].is_condensed && !going.contains(node) &&
                       !frozen_.contains(node) && !free.contains(node);
    if (!stays || distance_m >= least_m) continue;
    least_m = distance_m;
    nearest = node;
  }
  if (!nearest) return std::nullopt;
  return Anchor{*nearest, pose(*nearest)};
}

}  // namespace understory::geoslam_mapper::smoothing
