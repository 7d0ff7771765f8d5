#include "services/geoslam_mapper/smoothing/known_ground.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Nodes that are looked at together, and those after them that stay as they are. Motions between
/// nodes that go are lost: the share of the motions that the pose now rests on is small then.
constexpr std::size_t kTogether = 12;
constexpr std::size_t kStay = 4;
/// The older node is of another pass: the vehicle drove so many times the radius in between.
constexpr double kAnotherPass = 10.0;
/// So much of what the node observed must be known from there.
constexpr double kKnownShare = 0.5;
std::size_t count_common(const Node& a, const Node& b) {
  return static_cast<std::size_t>(
      std::count_if(a.observations().begin(), a.observations().end(),
                    [&](const auto& entry) { return b.observations().contains(entry.first); }));
}

/// Landmarks in common that the older node must have: half of them, and enough to hold the node.
/// One that observed little hangs on its motions, and these are the only ties of the path there.
std::size_t least_common(const Node& here) {
  const double half = kKnownShare * static_cast<double>(here.observations().size());
  return std::max(kHold, static_cast<std::size_t>(std::ceil(half)));
}

}  // namespace

std::vector<Retirement> KnownGround::follow(const FusedKeyframe& fused, Discovery& discovery,
                                            Merges& merges, GlobalMap& map) {
  if (radius_m_ <= 0.0 || (!recent_.empty() && recent_.back().node == fused.node)) return {};
  recent_.push_back({fused.node, fused.is_new_node});
  if (recent_.size() < kTogether + kStay) return {};

  Surplus surplus = find_surplus(map);
  recent_.erase(recent_.begin(), recent_.begin() + kTogether);
  if (surplus.nodes.empty() && surplus.loose.empty() && surplus.motions.empty()) return {};

  std::vector<std::pair<model::LandmarkId, Retirement>> handed_over;
  for (const Retirement& one : surplus.nodes) {
    for (const auto& [id, factor] : map.graph.node(one.node).observations())
      handed_over.emplace_back(id, one);
  }

  map.graph.checkpoint();
  map.graph.take_out(surplus);
  if (!map.graph.solve().ok) {
    map.graph.rollback();
    return {};
  }

  for (const auto& [id, one] : handed_over) map.landmarks.at(id).replace(one.node, one.into);
  for (const Retirement& one : surplus.nodes) {
    discovery.hand_over(one);
    merges.hand_over(one.node);
    map.trajectory.hand_over(one);
  }
  map.adopt_estimates();
  return std::move(surplus.nodes);
}

/// Among the oldest of the recent nodes, without those where the vehicle was again since.
Surplus KnownGround::find_surplus(const GlobalMap& map) const {
  Surplus result;
  const auto stay = recent_.begin() + kTogether;
  for (auto passed = recent_.begin(); passed != stay; ++passed) {
    const bool is_first = passed == recent_.begin();
    if (!passed->is_new) {
      if (!is_first && !std::prev(passed)->is_new)
        result.motions.emplace_back(std::prev(passed)->node, passed->node);
      continue;
    }

    const bool is_there_again = std::any_of(
        stay, recent_.end(), [&](const Passed& later) { return later.node == passed->node; });
    if (!is_there_again) judge(passed->node, map, result);
  }
  return result;
}

/// What was observed on the second pass stays as it was, without the motions: a node of its own,
/// since the first pass's nodes tie the map to its origin and that is no better known now. From the
/// third pass on it is added to the second's.
void KnownGround::judge(NodeIndex node, const GlobalMap& map, Surplus& surplus) const {
  const auto reference = reference_of(node, map);
  if (!reference) return;
  const Node& there = map.graph.node(*reference);
  if (!there.motions().empty()) {
    surplus.loose.push_back(node);
  } else if (auto into_T_node = map.graph.relative(*reference, node)) {
    surplus.nodes.push_back({node, *reference, *std::move(into_T_node)});
  }
}

/// The nearest node of another pass that knows most of what this one observed, a loose one if there
/// is one.
std::optional<NodeIndex> KnownGround::reference_of(NodeIndex node, const GlobalMap& map) const {
  const Node& here = map.graph.node(node);
  const std::size_t least = least_common(here);
  const Eigen::Vector2d here_m = map.graph.pose(node).translation();
  std::optional<NodeIndex> best;
  std::pair<bool, double> best_rank{true, radius_m_};

  map.trajectory.for_each_node_near(
      here_m, radius_m_, map.graph, [&](NodeIndex other, double distance_m) {
        const Node& there = map.graph.node(other);
        const std::pair<bool, double> rank{!there.motions().empty(), distance_m};
        if (rank >= best_rank || here.along_m - there.along_m < kAnotherPass * radius_m_ ||
            is_recent(other)) {
          return;
        }
        if (count_common(here, there) < least) return;

        best = other;
        best_rank = rank;
      });
  return best;
}

bool KnownGround::is_recent(NodeIndex node) const {
  return std::any_of(recent_.begin(), recent_.end(),
                     [&](const Passed& passed) { return passed.node == node; });
}

}  // namespace understory::geoslam_mapper::smoothing
