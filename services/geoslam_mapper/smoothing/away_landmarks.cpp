// Landmarks out of the graph: what they measure of the nodes, as motions that stay.
#include <algorithm>
#include <map>
#include <stdexcept>

#include "services/geoslam_mapper/smoothing/pose_graph.hpp"

namespace understory::geoslam_mapper::smoothing {

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
    if (free_away_ties_.empty()) {
      free_away_ties_.push_back(static_cast<AwayTieId>(away_ties_.size()));
      away_ties_.emplace_back();
    }
    away.ties.push_back(free_away_ties_.back());
    away_ties_[free_away_ties_.back()] = put(tie(nodes, theirs));
    free_away_ties_.pop_back();
    std::vector<model::LandmarkId>& all = ties_.at(nodes).landmarks;
    std::erase_if(all, [&](auto id) { return std::ranges::find(theirs, id) != theirs.end(); });
    changed.insert(nodes);
  }
  renew(changed);

  away.observed.reserve(ids.size());
  for (const model::LandmarkId id : ids) {
    const auto entry = dormant_.find(id);
    for (const DormantObservation& one : entry->second) {
      std::vector<model::LandmarkId>& left = dormant_of_node_[one.node].landmarks;
      std::erase(left, id);
      if (left.empty()) left.shrink_to_fit();  // A kilobyte for each node there ever was.
    }
    away.observed.push_back(std::move(entry->second));
    dormant_.erase(entry);
  }
  return away;
}

void PoseGraph::bring_back(std::span<const model::LandmarkId> ids, const AwayLandmarks& away) {
  const auto is_good = [&](const DormantObservation& one) {
    return one.node < nodes_.size() && nodes_[one.node].is_condensed &&
           one.position_m.allFinite() && one.information.allFinite() &&
           one.information.determinant() > 0.0;
  };
  bool fits = ids.size() == away.observed.size();
  for (const auto& observed : away.observed)
    fits = fits && !observed.empty() && std::ranges::all_of(observed, is_good);
  if (!fits || std::ranges::any_of(ids, [&](auto id) { return dormant_.contains(id); }))
    throw std::invalid_argument("submap: its landmarks do not fit the graph");

  for (const AwayTieId tie : away.ties) take_away_tie_out(tie);
  std::set<TiedNodes> changed;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    dormant_.emplace(ids[i], away.observed[i]);
    for (const DormantObservation& one : away.observed[i]) {
      if (dormant_of_node_.size() <= one.node) dormant_of_node_.resize(one.node + 1);
      dormant_of_node_[one.node].landmarks.push_back(ids[i]);
    }
    for (const TiedNodes& nodes : tied_by(ids[i])) {
      ties_[nodes].landmarks.push_back(ids[i]);
      changed.insert(nodes);
    }
  }
  renew(changed);
}

std::span<const model::LandmarkId> PoseGraph::dormant_of(NodeIndex node) const {
  if (node >= dormant_of_node_.size()) return {};
  return dormant_of_node_[node].landmarks;
}

}  // namespace understory::geoslam_mapper::smoothing
