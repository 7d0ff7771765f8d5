#include "services/geoslam_mapper/smoothing/relative_variance.hpp"

#include <algorithm>
#include <limits>
#include <span>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Most landmarks whose exact covariance is computed. It varies slowly over a part of the map that
/// was observed at one time.
constexpr std::size_t kMaxExact = 8;

double squared_distance(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return (a - b).squaredNorm();
}

/// Up to `most` of the points, each the one furthest from those before it.
std::vector<std::size_t> spread(std::span<const Eigen::Vector2d> points, std::size_t most) {
  std::vector<std::size_t> chosen;
  std::vector<double> nearest(points.size(), std::numeric_limits<double>::infinity());
  while (chosen.size() < std::min(most, points.size())) {
    const auto furthest = std::max_element(nearest.begin(), nearest.end());
    chosen.push_back(static_cast<std::size_t>(furthest - nearest.begin()));
    for (std::size_t i = 0; i < points.size(); ++i)
      nearest[i] = std::min(nearest[i], squared_distance(points[i], points[chosen.back()]));
  }
  return chosen;
}

/// Landmarks whose error the vehicle does not share.
struct OldLandmarks {
  std::vector<std::size_t> numbers;  ///< Among the landmarks asked for.
  std::vector<model::LandmarkId> ids;
  std::vector<Eigen::Vector2d> positions;
};

/// Of the landmarks `chosen` among the old ones, the one nearest to old landmark `i`.
std::size_t nearest_chosen(const OldLandmarks& old, const std::vector<std::size_t>& chosen,
                           std::size_t i) {
  std::size_t nearest = 0;
  for (std::size_t k = 1; k < chosen.size(); ++k) {
    if (squared_distance(old.positions[i], old.positions[chosen[k]]) <
        squared_distance(old.positions[i], old.positions[chosen[nearest]])) {
      nearest = k;
    }
  }
  return nearest;
}

}  // namespace

bool is_recent(const StoredLandmark& landmark, const GlobalMap& map, int recent_keyframes) {
  return landmark.last_keyframe + static_cast<std::uint32_t>(recent_keyframes) >=
         map.trajectory.size();
}

std::vector<double> relative_variances(const std::vector<model::LandmarkId>& ids,
                                       const GlobalMap& map, int recent_keyframes) {
  // The local variance, and which landmarks need more.
  std::vector<double> variances;
  OldLandmarks old;
  for (const model::LandmarkId id : ids) {
    const StoredLandmark& landmark = map.landmarks.at(id);
    variances.push_back(landmark.local_variance());
    if (is_recent(landmark, map, recent_keyframes) || !map.graph.position(id)) continue;
    old.numbers.push_back(variances.size() - 1);
    old.ids.push_back(id);
    old.positions.push_back(landmark.position_m);
  }
  if (old.ids.empty() || map.trajectory.bases().empty()) return variances;

  // The exact variance of a few.
  const std::vector<std::size_t> chosen = spread(old.positions, kMaxExact);
  std::vector<model::LandmarkId> chosen_ids;
  chosen_ids.reserve(chosen.size());
  for (const std::size_t i : chosen) chosen_ids.push_back(old.ids[i]);
  const std::vector<double> exact =
      map.graph.relative_variances(map.trajectory.last().node, chosen_ids);
  if (exact.empty()) return variances;

  // The others take that of the nearest of them.
  for (std::size_t i = 0; i < old.ids.size(); ++i) {
    double& variance = variances[old.numbers[i]];
    variance = std::max(variance, exact[nearest_chosen(old, chosen, i)]);
  }
  return variances;
}

}  // namespace understory::geoslam_mapper::smoothing
