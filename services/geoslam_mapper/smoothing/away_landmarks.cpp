// Stored landmarks: their information on the nodes stays in the graph as motions.
#include <algorithm>
#include <map>
#include <stdexcept>

#include "services/geoslam_mapper/smoothing/pose_graph.hpp"

namespace understory::geoslam_mapper::smoothing {

namespace plane = factor_graph::plane;

AwayLandmarks PoseGraph::put_away(std::span<const model::LandmarkId> ids) {
  std::map<TiedNodes, std::vector<model::LandmarkId>> tied;
  for (const model::LandmarkId id : ids) {
    for (const TiedNodes& nodes : tied_by(id)) tied[nodes].push_back(id);
  }

  // For each tie the motion of these landmarks; with the remaining ones it sums up to the graph's
  // motion.
  AwayLandmarks away;
  away.ties.reserve(tied.size());
  for (const auto& [nodes, theirs] : tied) {
    const plane::RelativePose motion = tie(nodes, theirs);
    away.ties.push_back({nodes.first, nodes.second, motion.a_T_b, motion.information, 1, 0});
    add_away(away.ties.back());
    const std::vector<model::LandmarkId>& going = theirs;
    std::erase_if(ties_.at(nodes).landmarks,
                  [&](auto id) { return std::ranges::find(going, id) != going.end(); });
  }

  away.observed.reserve(ids.size());
  for (const model::LandmarkId id : ids) {
    const auto entry = dormant_.find(id);
    for (const DormantObservation& one : entry->second) wakes(one.node, id);
    away.observed.push_back(std::move(entry->second));
    dormant_.erase(entry);
  }
  return away;
}

void PoseGraph::bring_back(std::span<const model::LandmarkId> ids, const AwayLandmarks& away) {
  const auto is_good = [&](const DormantObservation& one) {
    return one.node < nodes_.size() && nodes_[one.node].is_condensed &&
           !frozen_.contains(one.node) && one.position_m.allFinite() &&
           one.information.allFinite() && one.information.determinant() > 0.0;
  };
  bool fits = ids.size() == away.observed.size();
  for (const auto& observed : away.observed)
    fits = fits && !observed.empty() && std::ranges::all_of(observed, is_good);
  const auto stands = [&](const FrozenMotion& one) {
    const auto found = ties_.find({one.a, one.b});
    return found != ties_.end() && found->second.submaps > 0;
  };
  fits = fits && std::ranges::all_of(away.ties, stands);
  if (!fits || std::ranges::any_of(ids, [&](auto id) { return dormant_.contains(id); }))
    throw std::invalid_argument("submap: its landmarks do not fit the graph");

  std::set<TiedNodes> stood_for;
  for (const FrozenMotion& one : away.ties) {
    take_away_out(one);
    stood_for.emplace(one.a, one.b);
  }
  std::set<TiedNodes> changed;  // Empty, if the payload is unchanged.
  for (std::size_t i = 0; i < ids.size(); ++i) {
    dormant_.emplace(ids[i], away.observed[i]);
    for (const DormantObservation& one : away.observed[i]) {
      dormant_of_node_[one.node].landmarks.push_back(ids[i]);
    }
    for (const TiedNodes& nodes : tied_by(ids[i])) {
      ties_[nodes].landmarks.push_back(ids[i]);
      if (!stood_for.contains(nodes)) changed.insert(nodes);
    }
  }
  for (const TiedNodes& nodes : stood_for)
    if (ties_.at(nodes).landmarks.empty()) changed.insert(nodes);
  renew(changed);
}

/// Two nodes near each other share landmarks of several submaps: memory on a long drive allows one
/// motion for all of them. The graph's motion stays.
void PoseGraph::add_away(const FrozenMotion& motion) {
  Tie& tie = ties_[{motion.a, motion.b}];
  const MeasuredMotion fresh{motion.a_T_b, motion.information};
  tie.away = tie.submaps == 0 ? fresh : fused(tie.away, fresh);
  tie.submaps += motion.away;
}

void PoseGraph::take_away_out(const FrozenMotion& motion) {
  Tie& tie = ties_.at({motion.a, motion.b});
  if (tie.submaps <= motion.away) {
    tie.submaps = 0;
    tie.away = {};
    return;
  }
  tie.away = without(tie.away, {motion.a_T_b, motion.information});
  tie.submaps -= motion.away;
}

std::span<const model::LandmarkId> PoseGraph::dormant_of(NodeIndex node) const {
  const auto found = dormant_of_node_.find(node);
  if (found == dormant_of_node_.end()) return {};
  return found->second.landmarks;
}

}  // namespace understory::geoslam_mapper::smoothing
