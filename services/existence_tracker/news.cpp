#include "services/existence_tracker/news.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace understory::existence_tracker {

void News::make_due(model::LandmarkId id, TrackedPoint& tracked) {
  if (!std::exchange(tracked.state_is_due, true)) due_.push_back(id);
}

void News::begin_anew() {
  touched_.clear();
  due_.clear();
}

std::set<model::LandmarkId> News::take_ids(const PointsById& points) {
  std::set<model::LandmarkId> ids;
  for (const model::LandmarkId id : std::exchange(touched_, {})) {
    const auto found = points.find(id);
    if (found == points.end()) continue;  // Added since the last keyframe, and merged by this one.
    const TrackedPoint& tracked = found->second;
    const double change = std::abs(tracked.point.probability() - tracked.told_probability);
    if (change > parameters_.told_change || tracked.is_in_use != tracked.was_told_in_use)
      ids.insert(id);
  }

  auto next = points.upper_bound(repeated_);
  for (int i = 0; i < parameters_.repeated && !points.empty(); ++i, ++next) {
    if (next == points.end()) next = points.begin();
    ids.insert(next->first);
    repeated_ = next->first;
  }
  return ids;
}

std::vector<model::LandmarkId> News::take_due() {
  std::vector<model::LandmarkId> ids = std::exchange(due_, {});
  std::ranges::sort(ids);
  return ids;
}

}  // namespace understory::existence_tracker
