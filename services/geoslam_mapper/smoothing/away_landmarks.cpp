// Landmarks out of the graph: what they measure of the nodes, as motions that stay.
#include <algorithm>
#include <map>
#include <stdexcept>

#include "services/geoslam_mapper/smoothing/fused_motion.hpp"
#include "services/geoslam_mapper/smoothing/pose_graph.hpp"

namespace understory::geoslam_mapper::smoothing {

namespace plane = factor_graph::plane;

AwayLandmarks PoseGraph::put_away(std::span<const model::LandmarkId> ids) {
  std::map<TiedNodes, std::vector<model::LandmarkId>> tied;
  for (const model::LandmarkId id : ids) {
    for (const TiedNodes& nodes : tied_by(id)) tied[nodes].push_back(id);
  }

  // Each tie in two: what they tell, and what those tell that stay.
  AwayLandmarks away;
  std::set<TiedNodes> changed;
  away.ties.reserve(tied.size());
  for (const auto& [nodes, tied_ids] : tied) {
    const std::vector<model::LandmarkId>& theirs = tied_ids;
    const plane::RelativePose motion = tie(nodes, theirs);
    away.ties.push_back({nodes.first, nodes.second, motion.a_T_b, motion.information, 1, 0});
    add_away(away.ties.back());
    std::vector<model::LandmarkId>& all = ties_.at(nodes).landmarks;
    std::erase_if(all, [&](auto id) { return std::ranges::find(theirs, id) != theirs.end(); });
    changed.insert(nodes);
  }
  renew(changed);

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
  const auto stands = [&](const FrozenMotion& one) { return away_ties_.contains({one.a, one.b}); };
  fits = fits && std::ranges::all_of(away.ties, stands);
  if (!fits || std::ranges::any_of(ids, [&](auto id) { return dormant_.contains(id); }))
    throw std::invalid_argument("submap: its landmarks do not fit the graph");

  for (const FrozenMotion& tie : away.ties) take_away_out(tie);
  std::set<TiedNodes> changed;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    dormant_.emplace(ids[i], away.observed[i]);
    for (const DormantObservation& one : away.observed[i]) {
      dormant_of_node_[one.node].landmarks.push_back(ids[i]);
    }
    for (const TiedNodes& nodes : tied_by(ids[i])) {
      ties_[nodes].landmarks.push_back(ids[i]);
      changed.insert(nodes);
    }
  }
  renew(changed);
}

/// Each two nodes that lie near each other have landmarks in common that are parts of several
/// submaps: one motion of them is what a long drive has room for.
void PoseGraph::add_away(const FrozenMotion& tie) {
  const auto entry = away_ties_.find({tie.a, tie.b});
  if (entry == away_ties_.end()) {
    const plane::MotionId motion =
        put({nodes_[tie.a].centre, nodes_[tie.b].centre, tie.a_T_b, tie.information});
    away_ties_.emplace(TiedNodes{tie.a, tie.b}, AwayTie{motion, tie.away});
    return;
  }
  plane::RelativePose motion = smoother_.motion(entry->second.motion);
  const MeasuredMotion sum =
      fused({motion.a_T_b, motion.information}, {tie.a_T_b, tie.information});
  motion.a_T_b = sum.a_T_b;
  motion.information = sum.information;
  smoother_.set(entry->second.motion, motion);
  entry->second.submaps += tie.away;
}

void PoseGraph::take_away_out(const FrozenMotion& tie) {
  const auto entry = away_ties_.find({tie.a, tie.b});
  if (entry->second.submaps <= tie.away) {
    take_out(entry->second.motion);
    away_ties_.erase(entry);
    return;
  }
  plane::RelativePose motion = smoother_.motion(entry->second.motion);
  const MeasuredMotion rest =
      without({motion.a_T_b, motion.information}, {tie.a_T_b, tie.information});
  motion.a_T_b = rest.a_T_b;
  motion.information = rest.information;
  smoother_.set(entry->second.motion, motion);
  entry->second.submaps -= tie.away;
}

std::span<const model::LandmarkId> PoseGraph::dormant_of(NodeIndex node) const {
  const auto found = dormant_of_node_.find(node);
  if (found == dormant_of_node_.end()) return {};
  return found->second.landmarks;
}

}  // namespace understory::geoslam_mapper::smoothing
