#include "services/geoslam_mapper/map_difference.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace understory::geoslam_mapper {
namespace {

/// A position is told anew when it is off by this share of its standard deviation, but not before
/// `moved_m` and not later than this [m].
constexpr double kMovedSigmas = 0.25;
constexpr double kMovedAtMost_m = 0.02;

/// Whether a subscriber that has `told` must hear of `now`.
bool has_moved(const model::MapLandmark& told, const model::MapLandmark& now, double moved_m) {
  const double sigma_m = std::sqrt(std::max(0.0, 0.5 * told.covariance_m2.trace()));
  const double tolerated_m = std::max(moved_m, std::min(kMovedAtMost_m, kMovedSigmas * sigma_m));
  return (told.position_m - now.position_m).norm() > tolerated_m;
}

/// In a list in order of id, the first that is not below `id`.
template <class Landmarks>
auto first_not_below(Landmarks& landmarks, model::LandmarkId id) {
  return std::lower_bound(
      landmarks.begin(), landmarks.end(), id,
      [](const model::MapLandmark& one, model::LandmarkId wanted) { return one.id < wanted; });
}

}  // namespace

model::MapDelta map_difference(const std::vector<model::MapLandmark>& before,
                               const std::vector<model::MapLandmark>& after,
                               const model::MapUpdate& update, double moved_m) {
  model::MapDelta delta;
  delta.utime = update.utime;
  delta.merged = update.merged;

  std::set<model::LandmarkId> merged;
  for (const auto& [old_id, new_id] : update.merged) merged.insert(old_id);

  auto old = before.begin();
  const auto gone = [&](const model::MapLandmark& landmark) {
    if (!merged.contains(landmark.id)) delta.removed.push_back(landmark.id);
  };

  for (const model::MapLandmark& landmark : after) {
    while (old != before.end() && old->id < landmark.id) gone(*old++);
    if (old == before.end() || old->id != landmark.id) {
      delta.added.push_back(landmark);
      continue;
    }
    if (has_moved(*old, landmark, moved_m)) delta.moved.push_back(landmark);
    ++old;
  }
  while (old != before.end()) gone(*old++);
  return delta;
}

model::MapDelta map_change(const std::vector<model::MapLandmark>& before,
                           const std::vector<model::MapLandmark>& changed,
                           const model::MapUpdate& update, double moved_m) {
  model::MapDelta delta;
  delta.utime = update.utime;
  delta.merged = update.merged;
  for (const model::LandmarkId id : update.removed) {
    const auto old = first_not_below(before, id);
    if (old != before.end() && old->id == id) delta.removed.push_back(id);
  }
  for (const model::MapLandmark& landmark : changed) {
    const auto old = first_not_below(before, landmark.id);
    if (old == before.end() || old->id != landmark.id) {
      delta.added.push_back(landmark);
    } else if (has_moved(*old, landmark, moved_m)) {
      delta.moved.push_back(landmark);
    }
  }
  return delta;
}

bool displaces_most(const std::vector<model::MapLandmark>& before, const model::MapDelta& delta,
                    double distance_m) {
  const auto displaced = std::ranges::count_if(delta.moved, [&](const model::MapLandmark& now) {
    const auto old = first_not_below(before, now.id);
    return old != before.end() && old->id == now.id &&
           (old->position_m - now.position_m).norm() > distance_m;
  });
  return 2 * static_cast<std::size_t>(displaced) > before.size();
}

}  // namespace understory::geoslam_mapper
