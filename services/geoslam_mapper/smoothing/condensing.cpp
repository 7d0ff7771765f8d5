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

Condensing::Due Condensing::due(double range_m, const KnownGround& known_ground,
                                const GlobalMap& map) {
  Due due;
  due.waited = complete(range_m, known_ground, map);
  const std::vector<Passed> stretch = present(due.waited, map.graph);
  for (const Passed& passed : stretch) due.nodes.push_back(passed.node);
  if (keeps_stretches_ && !stretch.empty()) due.was = stretch_of(stretch, map);
  return due;
}

void Condensing::compute_ahead(double range_m, const KnownGround& known_ground, GlobalMap& map) {
  std::vector<NodeIndex> nodes;
  for (const Passed& passed : present(complete(range_m, known_ground, map), map.graph))
    nodes.push_back(passed.node);
  if (!nodes.empty()) map.graph.condense_ahead(nodes);
}

/// How many of those that wait end with the oldest stretch; 0 where it cannot be condensed yet.
std::size_t Condensing::complete(double range_m, const KnownGround& known_ground,
                                 const GlobalMap& map) {
  while (!waiting_.empty() && !is_there(waiting_.front(), map.graph)) waiting_.pop_front();
  if (parameters_.condense_m <= 0.0 || waiting_.empty()) return 0;

  const double now_m = map.graph.node(map.trajectory.last().node).along_m;
  const double end_m = now_m - parameters_.condense_after_m;
  const CutPolicy policy = cut_policy(parameters_, range_m);
  const auto size = first_stretch(cut_nodes(policy, end_m, map.graph), policy);
  if (!size) return 0;
  const bool is_judged =
      std::none_of(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(*size),
                   [&](const Passed& passed) { return known_ground.is_recent(passed.node); });
  return is_judged ? *size : 0;
}

/// Those of the first ones that wait that are in the graph.
std::vector<Condensing::Passed> Condensing::present(std::size_t count,
                                                    const PoseGraph& graph) const {
  std::vector<Passed> result;
  std::copy_if(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count),
               std::back_inserter(result),
               [&](const Passed& passed) { return is_there(passed, graph); });
  return result;
}

void Condensing::follow(const FusedKeyframe& fused, Due due, Discovery& discovery, Merges& merges,
                        GlobalMap& map) {
  if (fused.is_new_node && (parameters_.condense_m > 0.0 || keeps_stretches_)) {
    const auto scans = static_cast<std::uint32_t>(fused.keyframe.members.size());
    waiting_.push_back({fused.node, map.graph.node(fused.node).along_m, scans, next_number_});
    next_number_ = StretchNumber(index(next_number_) + 1);
  }
  if (!fused.took_stretch) return;

  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(due.waited));
  if (!fused.condensed.empty()) adopt(fused.condensed, discovery, merges, map);
  if (!due.was) return;
  stretches_.push_back(*std::move(due.was));
  if (!fused.condensed.empty()) stretches_.back().turn_to(fused.condensed);
}

/// Who knew the nodes knows the one that they became.
void Condensing::adopt(std::span<const Retirement> retired, Discovery& discovery, Merges& merges,
                       GlobalMap& map) {
  for (const auto& [id, factor] : map.graph.node(retired.front().into).observations()) {
    StoredLandmark& landmark = map.landmarks.at(id);
    for (const Retirement& one : retired) landmark.replace(one.node, one.into);
  }
  for (const Retirement& one : retired) {
    discovery.hand_over(one);
    merges.hand_over(one.node);
  }
  map.trajectory.tie(retired, map.graph);
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
    const auto& observations = graph.node(passed.node).observations();
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
  const auto& earlier = graph.node(before).observations();
  std::size_t common = 0;
  for (const auto& [id, factor] : graph.node(node).observations()) {
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
         !(node.observations().empty() && node.motions().empty());
}

}  // namespace understory::geoslam_mapper::smoothing
