// Reduces the information on a stretch of the path.
#include <algorithm>

#include "services/geoslam_mapper/smoothing/pose_graph.hpp"

namespace understory::geoslam_mapper::smoothing {

namespace plane = factor_graph::plane;

void PoseGraph::relax(NodeIndex a, NodeIndex b, const ShareAlong& share_at) {
  ahead_.reset();
  const auto [from_m, to_m] = std::minmax({nodes_[a].along_m, nodes_[b].along_m});
  std::set<std::pair<bool, std::uint32_t>> motions;

  for (NodeIndex node = 0; node < nodes_.size(); ++node) {
    if (!is_within(node, from_m, to_m)) continue;
    for (const auto& [id, number] : nodes_[node].observations()) {
      plane::PointObservation factor = smoother_.observation(number);
      factor.information *= share_at(nodes_[node].along_m);
      smoother_.set(number, factor);
    }
    for (const MotionRef& ref : nodes_[node].motions()) {
      const auto [first, second] = ends_of(ref);
      const bool is_closure = !ref.is_biased && closures_.contains(ref.number);
      if (!is_closure && is_within(first, from_m, to_m) && is_within(second, from_m, to_m))
        motions.emplace(ref.is_biased, ref.number);
    }
  }

  for (const auto& [is_biased, number] : motions) {
    const MotionRef ref{is_biased, number};
    const auto [first, second] = ends_of(ref);
    scale_information(ref, share_at(middle_m(first, second)));
  }
  relax_dormant(from_m, to_m, share_at);
}

double PoseGraph::middle_m(NodeIndex a, NodeIndex b) const {
  return 0.5 * (nodes_[a].along_m + nodes_[b].along_m);
}

bool PoseGraph::is_within(NodeIndex node, double from_m, double to_m) const {
  return nodes_[node].along_m >= from_m && nodes_[node].along_m <= to_m;
}

void PoseGraph::scale_information(MotionRef ref, double share) {
  if (ref.is_biased) {
    plane::BiasedRelativePose factor = smoother_.motion(plane::BiasedMotionId(ref.number));
    factor.motion.information *= share;
    smoother_.set(plane::BiasedMotionId(ref.number), factor);
  } else {
    plane::RelativePose factor = smoother_.motion(plane::MotionId(ref.number));
    factor.information *= share;
    smoother_.set(plane::MotionId(ref.number), factor);
  }
}

/// Relaxes dormant landmarks and the motions that represent them.
void PoseGraph::relax_dormant(double from_m, double to_m, const ShareAlong& share_at) {
  std::set<TiedNodes> changed;
  for (auto& [id, observed] : dormant_) {
    bool is_relaxed = false;
    for (DormantObservation& one : observed) {
      if (!is_within(one.node, from_m, to_m)) continue;
      one.information *= share_at(nodes_[one.node].along_m);
      is_relaxed = true;
    }
    if (!is_relaxed) continue;
    const std::vector<TiedNodes> ties = tied_by(id);
    changed.insert(ties.begin(), ties.end());
  }
  for (auto& [nodes, tie] : ties_) {
    if (!is_within(nodes.first, from_m, to_m) || !is_within(nodes.second, from_m, to_m)) continue;
    tie.away.information *= share_at(middle_m(nodes.first, nodes.second));
    changed.insert(nodes);
  }
  renew(changed);
}

}  // namespace understory::geoslam_mapper::smoothing
