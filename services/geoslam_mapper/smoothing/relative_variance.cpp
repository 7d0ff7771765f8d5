#include "services/geoslam_mapper/smoothing/relative_variance.hpp"

#include <algorithm>
#include <limits>
#include <span>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Most landmarks whose exact covariance is computed. It varies slowly over a part of the map that
/// was observed at one time.
constexpr std::size_t kMaxExact = 8;
/// Path length assigned to landmarks that no drive of this map has observed [m]: far from all
/// others.
constexpr double kBeforeAll_m = -1e6;

/// Position of a landmark, and the vehicle's path length at its last observation [m]. Two passes by
/// one place are distant in this space: their errors are independent.
using PathPlace = Eigen::Vector3d;

PathPlace place_of(const StoredLandmark& landmark, const PoseGraph& graph) {
  const double along_m =
      landmark.nodes.empty() ? kBeforeAll_m : graph.node(landmark.nodes.back()).along_m;
  return {landmark.position_m.x(), landmark.position_m.y(), along_m};
}

double squared_distance(const PathPlace& a, const PathPlace& b) { return (a - b).squaredNorm(); }

/// Up to `most` of the points, each the one furthest from the points chosen before.
std::vector<std::size_t> spread(std::span<const PathPlace> points, std::size_t most) {
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

/// Landmarks that do not share the vehicle's error.
struct OldLandmarks {
  std::vector<std::size_t> numbers;  ///< Indices in the input.
  std::vector<model::LandmarkId> ids;
  std::vector<PathPlace> places;
};

/// The chosen landmark that is nearest to old landmark `i`.
std::size_t nearest_chosen(const OldLandmarks& old, const std::vector<std::size_t>& chosen,
                           std::size_t i) {
  std::size_t nearest = 0;
  for (std::size_t k = 1; k < chosen.size(); ++k) {
    if (squared_distance(old.places[i], old.places[chosen[k]]) <
        squared_distance(old.places[i], old.places[chosen[nearest]])) {
      nearest = k;
    }
  }
  return nearest;
}

}  // namespace

bool is_recent(const StoredLandmark& landmark, const Reference& reference, int recent_keyframes,
               const Trajectory& trajectory) {
  const auto recent = static_cast<std::uint32_t>(recent_keyframes);
  return landmark.last_keyframe + recent >= reference.keyframe &&
         landmark.last_keyframe <= reference.keyframe + recent &&
         !trajectory.is_torn(landmark.last_keyframe, reference.keyframe);
}

std::vector<double> relative_variances(const std::vector<model::LandmarkId>& ids,
                                       const std::optional<Reference>& reference,
                                       int recent_keyframes, const GlobalMap& map) {
  // Local variances, and the list of landmarks that are not recent.
  std::vector<double> variances;
  OldLandmarks old;
  for (const model::LandmarkId id : ids) {
    const StoredLandmark& landmark = map.landmarks.at(id);
    variances.push_back(landmark.local_variance());
    if (!reference || is_recent(landmark, *reference, recent_keyframes, map.trajectory) ||
        !map.graph.position(id))
      continue;
    old.numbers.push_back(variances.size() - 1);
    old.ids.push_back(id);
    old.places.push_back(place_of(landmark, map.graph));
  }
  if (old.ids.empty()) return variances;

  // The exact variance of a few of these.
  const std::vector<std::size_t> chosen = spread(old.places, kMaxExact);
  std::vector<model::LandmarkId> chosen_ids;
  chosen_ids.reserve(chosen.size());
  for (const std::size_t i : chosen) chosen_ids.push_back(old.ids[i]);
  const std::vector<double> exact = map.graph.relative_variances(reference->node, chosen_ids);
  if (exact.empty()) return variances;

  // The others take the value of the nearest of them.
  for (std::size_t i = 0; i < old.ids.size(); ++i) {
    double& variance = variances[old.numbers[i]];
    variance = std::max(variance, exact[nearest_chosen(old, chosen, i)]);
  }
  return variances;
}

}  // namespace understory::geoslam_mapper::smoothing
