#include "services/geoslam_mapper/smoothing/condensing.hpp"

#include <algorithm>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Fewest nodes of a stretch.
constexpr std::ptrdiff_t kLeastNodes = 4;

}  // namespace

std::vector<Retirement> Condensing::follow(const FusedKeyframe& fused,
                                           const KnownGround& known_ground, Discovery& discovery,
                                           Merges& merges, GlobalMap& map) {
  if (length_m_ <= 0.0) return {};
  const double now_m = map.graph.node(fused.node).along_m;
  if (fused.is_new_node) waiting_.push_back({fused.node, now_m});
  const double range_m = fused.keyframe.field_of_view.max_range_m;
  const double length_m = std::min(length_m_, of_range_ * range_m);
  const double end_m = now_m - std::max(after_m_, range_m);
  const std::vector<NodeIndex> stretch = take_stretch(length_m, end_m, known_ground, map.graph);
  if (stretch.size() < 2) return {};

  std::vector<model::LandmarkId> observed;
  for (const NodeIndex node : stretch) {
    for (const auto& [id, factor] : map.graph.node(node).observations) observed.push_back(id);
  }
  std::sort(observed.begin(), observed.end());
  observed.erase(std::unique(observed.begin(), observed.end()), observed.end());

  map.graph.checkpoint();
  std::vector<Retirement> retired = map.graph.condense(stretch);
  if (retired.empty() || !map.graph.solve().ok) {
    map.graph.rollback();
    return {};
  }

  for (const model::LandmarkId id : observed) {
    StoredLandmark& landmark = map.landmarks.at(id);
    for (const Retirement& one : retired) landmark.replace(one.node, one.into);
  }
  for (const Retirement& one : retired) {
    discovery.hand_over(one);
    merges.hand_over(one.node);
  }
  map.trajectory.tie(retired, map.graph);
  map.adopt_estimates();
  return retired;
}

/// The nodes of the oldest stretch, once it is complete and ends before `end_m`; those that were
/// taken out of the graph since are not among them.
std::vector<NodeIndex> Condensing::take_stretch(double length_m, double end_m,
                                                const KnownGround& known_ground,
                                                const PoseGraph& graph) {
  const auto is_there = [&](const Passed& passed) {
    const Node& node = graph.node(passed.node);
    return node.along_m == passed.along_m && !node.is_condensed &&
           !(node.observations.empty() && node.motions.empty());
  };
  while (!waiting_.empty() && !is_there(waiting_.front())) waiting_.pop_front();
  if (waiting_.empty()) return {};
  const double last_m = waiting_.front().along_m + length_m;
  auto end = std::find_if(waiting_.begin(), waiting_.end(),
                          [&](const Passed& passed) { return passed.along_m >= last_m; });
  end = std::max(end, waiting_.begin() + std::min(kLeastNodes, std::ssize(waiting_)));
  if (end == waiting_.end() || end->along_m > end_m) return {};
  if (std::any_of(waiting_.begin(), end,
                  [&](const Passed& passed) { return known_ground.is_recent(passed.node); })) {
    return {};
  }

  std::vector<NodeIndex> nodes;
  for (auto passed = waiting_.begin(); passed != end; ++passed) {
    if (is_there(*passed)) nodes.push_back(passed->node);
  }
  waiting_.erase(waiting_.begin(), end);
  return nodes;
}

}  // namespace understory::geoslam_mapper::smoothing
