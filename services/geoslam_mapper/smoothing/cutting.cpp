#include "services/geoslam_mapper/smoothing/cutting.hpp"

#include <algorithm>
#include <cmath>

#include "common/geometry/se2.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Mean number of landmarks of the last kSamples scans; none where there are no scans.
std::optional<double> mean_landmarks(std::span<const CutNode> nodes) {
  std::uint32_t scans = 0;
  double sum = 0.0;
  for (auto node = nodes.rbegin(); node != nodes.rend() && scans < CutPolicy::kSamples; ++node) {
    const std::uint32_t counted = std::min(node->scans, CutPolicy::kSamples - scans);
    sum += static_cast<double>(counted) * node->landmarks;
    scans += counted;
  }
  if (scans == 0) return std::nullopt;
  return sum / scans;
}

/// Change of the heading over the last kTurn_m [rad].
double turn_of(std::span<const CutNode> nodes) {
  const CutNode* before = &nodes.back();
  for (auto node = nodes.rbegin(); node != nodes.rend(); ++node) {
    if (nodes.back().along_m - node->along_m > CutPolicy::kTurn_m) break;
    if (node->scans > 0) before = &*node;
  }
  return std::abs(geometry::wrap_angle(nodes.back().heading_rad - before->heading_rad));
}

/// Whether a stretch of sufficient length may end with the last of the nodes.
bool may_end(std::span<const CutNode> nodes, const CutPolicy& policy) {
  if (policy.sparse <= 0.0 && policy.dense <= 0.0 && policy.turn_rad <= 0.0) return true;
  const auto mean = mean_landmarks(nodes);
  if (policy.sparse > 0.0 && mean && *mean < policy.sparse) return true;
  if (policy.dense > 0.0 && mean && *mean > policy.dense) return true;
  return policy.turn_rad > 0.0 && turn_of(nodes) >= policy.turn_rad;
}

}  // namespace

CutPolicy cut_policy(const SmoothingMapperParameters& parameters, double range_m) {
  CutPolicy policy;
  policy.distance_m = std::min(parameters.condense_m, parameters.condense_of_range * range_m);
  policy.sparse = parameters.cut_sparse;
  policy.dense = parameters.cut_dense;
  policy.turn_rad = parameters.cut_turn_rad;
  policy.longest_m = std::max(parameters.cut_longest_m, policy.distance_m);
  policy.size = static_cast<std::size_t>(parameters.cut_size);
  return policy;
}

std::optional<std::size_t> first_stretch(std::span<const CutNode> nodes, const CutPolicy& policy) {
  std::size_t size = 0;
  for (std::size_t end = 1; end < nodes.size(); ++end) {
    size += 1 + nodes[end - 1].new_landmarks;
    if (!nodes[end].is_tied) return end;
    if (end < CutPolicy::kLeastNodes) continue;
    if (policy.size > 0 && size >= policy.size) return end;
    const double length_m = nodes[end].along_m - nodes.front().along_m;
    if (length_m < policy.distance_m) continue;
    if (length_m >= policy.longest_m || may_end(nodes.first(end), policy)) return end;
  }
  return std::nullopt;
}

}  // namespace understory::geoslam_mapper::smoothing
