#include "services/geoslam_mapper/smoothing/condensing.hpp"

#include <algorithm>
#include <iterator>
#include <optional>
#include <set>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// So many common landmarks tie two nodes, or a distance that is known as well as these tell it
/// (standard deviations).
constexpr std::size_t kTyingLandmarks = 2;
constexpr double kTied_m = 0.1;
constexpr double kTied_rad = 5e-3;

}  // namespace

std::vector<Retirement> Condensing::follow(const FusedKeyframe& fused,
                                           const KnownGround& known_ground, Discovery& discovery,
                                           Merges& merges, GlobalMap& map) {
  const bool condenses = parameters_.condense_m > 0.0;
  if (!condenses && !keeps_stretches_) return {};
  const double now_m = map.graph.node(fused.node).along_m;
  if (fused.is_new_node) {
    const auto scans = static_cast<std::uint32_t>(fused.keyframe.members.size());
    waiting_.push_back({fused.node, now_m, scans, next_number_});
    next_number_ = StretchNumber(index(next_number_) + 1);
  }
  if (!condenses) return {};

  const double range_m = fused.keyframe.field_of_view.max_range_m;
  const double end_m = now_m - std::max(parameters_.condense_after_m, range_m);
  const std::vector<Passed> stretch =
      take_stretch(cut_policy(parameters_, range_m), end_m, known_ground, map.graph);
  if (keeps_stretches_ && !stretch.empty()) stretches_.push_back(stretch_of(stretch, map));
  if (stretch.empty()) return {};

  std::vector<NodeIndex> nodes;
  nodes.reserve(stretch.size());
  for (const Passed& passed : stretch) nodes.push_back(passed.node);
  std::vector<Retirement> retired = condense(nodes, discovery, merges, map);
  if (keeps_stretches_ && !retired.empty()) stretches_.back().turn_to(retired);
  return retired;
}

std::vector<Retirement> Condensing::condense(std::span<const NodeIndex> nodes, Discovery& discovery,
                                             Merges& merges, GlobalMap& map) {
  std::vector<model::LandmarkId> observed;
  for (const NodeIndex node : nodes) {
    for (const auto& [id, factor] : map.graph.node(node).observations) observed.push_back(id);
  }
  std::sort(observed.begin(), observed.end());
  observed.erase(std::unique(observed.begin(), observed.end()), observed.end());

  map.graph.checkpoint();
  std::vector<Retirement> retired = map.graph.condense(nodes);
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
std::vector<Condensing::Passed> Condensing::take_stretch(const CutPolicy& policy, double end_m,
                                                         const KnownGround& known_ground,
                                                         const PoseGraph& graph) {
  while (!waiting_.empty() && !is_there(waiting_.front(), graph)) waiting_.pop_front();
  const auto size = first_stretch(cut_nodes(policy, end_m, graph), policy);
  if (!size) return {};
  const auto end = waiting_.begin() + static_cast<std::ptrdiff_t>(*size);
  if (std::any_of(waiting_.begin(), end,
                  [&](const Passed& passed) { return known_ground.is_recent(passed.node); })) {
    return {};
  }

  std::vector<Passed> stretch;
  std::copy_if(waiting_.begin(), end, std::back_inserter(stretch),
               [&](const Passed& passed) { return is_there(passed, graph); });
  waiting_.erase(waiting_.begin(), end);
  return stretch;
}

/// The nodes that wait and lie before `end_m`.
std::vector<CutNode> Condensing::cut_nodes(const CutPolicy& policy, double end_m,
                                           const PoseGraph& graph) const {
  std::vector<CutNode> nodes;
  std::set<model::LandmarkId> observed;
  std::optional<NodeIndex> before;
  for (const Passed& passed : waiting_) {
    if (passed.along_m > end_m) break;
    CutNode& node = nodes.emplace_back();
    node.along_m = passed.along_m;
    if (!is_there(passed, graph)) continue;

    node.heading_rad = graph.pose(passed.node).theta();
    node.scans = passed.scans;
    const auto& observations = graph.node(passed.node).observations;
    if (!observations.empty()) {
      node.is_tied = !before || are_tied(*before, passed.node, graph);
      before = passed.node;
    }
    node.landmarks = static_cast<std::uint32_t>(observations.size());
    if (policy.size == 0) continue;
    for (const auto& [id, factor] : observations)
      if (observed.insert(id).second) ++node.new_landmarks;
  }
  return nodes;
}

/// Whether neither a way without landmarks nor one without odometry lies between the two.
bool Condensing::are_tied(NodeIndex before, NodeIndex node, const PoseGraph& graph) {
  const auto& earlier = graph.node(before).observations;
  std::size_t common = 0;
  for (const auto& [id, factor] : graph.node(node).observations) {
    common += earlier.contains(id) ? 1 : 0;
    if (common == kTyingLandmarks) return true;
  }
  const auto relative = graph.relative(before, node);
  if (!relative) return false;
  const Eigen::Matrix3d& covariance = relative->covariance;
  return covariance.topLeftCorner<2, 2>().trace() < kTied_m * kTied_m &&
         covariance(2, 2) < kTied_rad * kTied_rad;
}

bool Condensing::is_there(const Passed& passed, const PoseGraph& graph) {
  const Node& node = graph.node(passed.node);
  return node.along_m == passed.along_m && !node.is_condensed &&
         !(node.observations.empty() && node.motions.empty());
}

}  // namespace understory::geoslam_mapper::smoothing
