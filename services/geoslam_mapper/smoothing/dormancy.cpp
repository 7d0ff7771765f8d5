#include "services/geoslam_mapper/smoothing/dormancy.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// The vehicle drives so far [m] between two searches for landmarks to wake or to make dormant.
constexpr double kBetween_m = 5.0;
/// Landmarks are awake so far [m] beyond the sensor's range, and become dormant so much further.
constexpr double kAwakeBeyond_m = 15.0;
constexpr double kDormantBeyond_m = 10.0;

/// The dormant ones around a place.
std::vector<model::LandmarkId> dormant_around(const Eigen::Vector2d& here_m, double radius_m,
                                              const GlobalMap& map) {
  std::vector<model::LandmarkId> ids;
  for (const model::LandmarkId id : map.landmarks.index().near({here_m, radius_m}))
    if (map.graph.is_dormant(id)) ids.push_back(id);
  return ids;
}

}  // namespace

void Dormancy::prepare(const model::FieldOfView& field_of_view, const Eigen::Vector2d& expected_m,
                       GlobalMap& map) const {
  if (!is_on_ || (expected_m - here_m_).norm() < 0.5 * kAwakeBeyond_m) return;
  map.wake(dormant_around(expected_m, field_of_view.max_range_m + kAwakeBeyond_m, map));
}

bool Dormancy::follow(const model::FieldOfView& field_of_view, NodeIndex newest, GlobalMap& map) {
  const double along_m = map.graph.node(newest).along_m;
  if (!is_on_ || std::abs(along_m - looked_m_) < kBetween_m) return false;
  looked_m_ = along_m;
  const Eigen::Vector2d here_m = map.graph.pose(newest).translation();
  here_m_ = here_m;
  const double awake_m = field_of_view.max_range_m + kAwakeBeyond_m;

  // Only what condensed nodes observed, and no prior holds.
  std::vector<model::LandmarkId> left;
  for (const model::LandmarkId id : map.graph.awake()) {
    const StoredLandmark& landmark = map.landmarks.at(id);
    const bool is_far = (landmark.position_m - here_m).norm() > awake_m + kDormantBeyond_m;
    if (!is_far || landmark.nodes.empty() || landmark.is_given()) continue;
    if (std::ranges::all_of(landmark.nodes,
                            [&](NodeIndex node) { return map.graph.node(node).is_condensed; })) {
      left.push_back(id);
    }
  }
  const std::vector<model::LandmarkId> met = dormant_around(here_m, awake_m, map);
  if (left.empty() && met.empty()) return false;

  map.graph.checkpoint();
  map.wake_unsolved(met);
  map.graph.make_dormant(left, map.landmarks.all());
  return true;  // What they tell is in the graph as before: the next keyframe's solution will do.
}

}  // namespace understory::geoslam_mapper::smoothing
