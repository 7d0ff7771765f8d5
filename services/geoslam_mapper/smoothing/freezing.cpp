// Nodes out of the solved graph, and what they measure of those that stay.
#include <algorithm>
#include <utility>

#include "services/geoslam_mapper/smoothing/pose_graph.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

namespace plane = factor_graph::plane;

/// Most nodes that a frozen part is tied to: their joint measurement is dense.
constexpr std::size_t kMostOuter = 24;

}  // namespace

bool PoseGraph::may_freeze(NodeIndex node) const {
  return nodes_[node].is_condensed && nodes_[node].observations.empty() &&
         dormant_of(node).empty() && !frozen_.contains(node) && node != newest_;
}

bool PoseGraph::freeze(std::span<const NodeIndex> nodes) {
  std::set<NodeIndex> going;
  for (const NodeIndex node : nodes)
    if (may_freeze(node)) going.insert(node);
  if (going.empty()) return false;

  const std::set<NodeIndex> frozen_before = frozen_;
  frozen_.insert(going.begin(), going.end());
  freeze_motions(going);
  const std::vector<FrozenPart> parts = parts_of(frozen_motions_, frozen_);
  if (std::ranges::any_of(parts, [](const auto& one) { return one.outer.size() > kMostOuter; })) {
    frozen_ = frozen_before;
    thaw_motions();
    return false;
  }
  gyro_.drop_idle(smoother_);
  condense_frozen(parts);
  return true;
}

/// Their motions go out of the solved graph, with the bias as known now.
void PoseGraph::freeze_motions(const std::set<NodeIndex>& nodes) {
  const auto keep = [&](const plane::RelativePose& motion) -> FrozenMotion& {
    return frozen_motions_.emplace_back(FrozenMotion{index(motion.a), index(motion.b), motion.a_T_b,
                                                     motion.information, std::nullopt, 0});
  };
  for (const NodeIndex node : nodes) {
    for (const MotionRef ref : std::exchange(edit(node).motions, {})) {
      const auto [from, to] = ends_of(ref);
      std::erase(edit(from == node ? to : from).motions, ref);
      const auto closure = ref.is_biased ? closures_.end() : closures_.find(ref.number);
      const std::uint64_t id = closure == closures_.end() ? 0 : closure->second;
      keep(take_motion_out(ref)).closure = id;
    }
  }

  for (AwayTieId tie = 0; tie < away_ties_.size(); ++tie) {
    if (!away_ties_[tie]) continue;
    const plane::RelativePose motion = smoother_.motion(*away_ties_[tie]);
    if (!nodes.contains(index(motion.a)) && !nodes.contains(index(motion.b))) continue;
    keep(motion).away_tie = tie;
    take_out(*std::exchange(away_ties_[tie], std::nullopt));
  }
}

void PoseGraph::thaw(std::span<const NodeIndex> nodes) {
  if (std::ranges::none_of(nodes, [&](NodeIndex node) { return frozen_.contains(node); })) return;
  settle_frozen();
  for (const NodeIndex node : nodes) frozen_.erase(node);
  thaw_motions();
  condense_frozen(parts_of(frozen_motions_, frozen_));
}

/// Motions of which no end is frozen any more are in the solved graph again.
void PoseGraph::thaw_motions() {
  std::vector<FrozenMotion> stay;
  for (const FrozenMotion& one : frozen_motions_) {
    if (frozen_.contains(one.a) || frozen_.contains(one.b)) {
      stay.push_back(one);
      continue;
    }
    const plane::RelativePose motion{nodes_[one.a].centre, nodes_[one.b].centre, one.a_T_b,
                                     one.information};
    if (one.away_tie) {
      away_ties_[*one.away_tie] = put(motion);
    } else {
      const MotionRef ref = link(motion, one.a, one.b);
      if (one.closure != 0) closures_.emplace(ref.number, one.closure);
    }
  }
  frozen_motions_ = std::move(stay);
}

void PoseGraph::condense_frozen(const std::vector<FrozenPart>& parts) {
  std::vector<plane::CondensedPoses> measured;
  for (const FrozenPart& part : parts) {
    auto one = condensed(part, [&](NodeIndex node) { return pose(node); });
    if (!one) continue;
    for (const NodeIndex node : part.outer) one->poses.push_back(nodes_[node].centre);
    measured.push_back(*std::move(one));
  }
  smoother_.set_condensed(measured);
}

void PoseGraph::settle_frozen() {
  for (const FrozenPart& part : parts_of(frozen_motions_, frozen_)) {
    const auto poses = inner_poses(part, [&](NodeIndex node) { return pose(node); });
    for (std::size_t i = 0; i < poses.size(); ++i)
      smoother_.restart(nodes_[part.inner[i]].centre, poses[i]);
  }
}

void PoseGraph::take_away_tie_out(AwayTieId tie) {
  if (away_ties_[tie]) {
    take_out(*std::exchange(away_ties_[tie], std::nullopt));
  } else {
    std::erase_if(frozen_motions_, [&](const FrozenMotion& one) { return one.away_tie == tie; });
    condense_frozen(parts_of(frozen_motions_, frozen_));
  }
  free_away_ties_.push_back(tie);
}

}  // namespace understory::geoslam_mapper::smoothing
