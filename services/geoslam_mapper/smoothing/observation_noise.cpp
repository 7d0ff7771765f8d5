#include "services/geoslam_mapper/smoothing/observation_noise.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Noise correlation below which two viewpoints count as independent.
constexpr double kIndependent = 0.02;

/// Factor on the variance of an observation for its correlation with earlier ones.
double variance_factor(const model::KeyframeLandmark& observed, NodeIndex node,
                       model::LandmarkId id, const SmoothingMapperParameters& parameters,
                       const GlobalMap& map) {
  const auto scans = static_cast<double>(observed.observation_count);
  if (map.graph.node(node).is_stationary && parameters.stationary_share > 0.0)
    return std::max(1.0, scans * parameters.stationary_share);
  if (parameters.correlated_share == 0.0) return 1.0;

  const Eigen::Vector2d here = map.graph.pose(node).translation();
  double views = scans;
  const std::vector<NodeIndex>& before = map.landmarks.at(id).nodes;
  for (auto other = before.rbegin(); other != before.rend(); ++other) {
    const Eigen::Vector2d there = map.graph.pose(*other).translation();
    const double correlation = std::exp(-(here - there).norm() / parameters.correlation_m);
    if (correlation < kIndependent) break;
    views += scans * map.graph.node(*other).keyframes * correlation;
  }
  return 1.0 + 2.0 * parameters.correlated_share * (views - 1.0);
}

}  // namespace

void observe(const model::KeyframeLandmark& observed, NodeIndex node, model::LandmarkId id,
             const SmoothingMapperParameters& parameters, GlobalMap& map) {
  const Node& from = map.graph.node(node);
  const bool repeats_itself =
      from.is_stationary && parameters.stationary_share > 0.0 && from.observations().contains(id);
  if (repeats_itself) return;
  const Eigen::Matrix2d information =
      observed.covariance_m2.inverse() / variance_factor(observed, node, id, parameters, map);
  map.graph.observe(node, id, observed.position_m, information);
}

}  // namespace understory::geoslam_mapper::smoothing
