#include "services/geoslam_mapper/map_difference.hpp"

#include <algorithm>
#include <cmath>

#include "services/geoslam_mapper/mapper_output.hpp"

namespace understory::geoslam_mapper {
namespace {

constexpr double kMovedSigmas = 0.25;
constexpr double kMostAround_m = 0.02;
constexpr double kMostFarAway_m = 0.10;

/// Whether a subscriber that has `told` needs `now`.
bool has_moved(const model::MapLandmark& told, const model::MapLandmark& now,
               const MapTolerance& tolerance) {
  const bool is_around = (now.position_m - tolerance.vehicle_m).norm() < kAroundVehicle_m;
  const double sigma_m = std::sqrt(std::max(0.0, 0.5 * told.covariance_m2.trace()));
  const double most_m =
      std::min(is_around ? kMostAround_m : kMostFarAway_m, kMovedSigmas * sigma_m);
  return (told.position_m - now.position_m).norm() > std::max(tolerance.moved_m, most_m);
}

/// The first element with an id not below `id`, in a list in order of id.
template <class Landmarks>
auto first_not_below(Landmarks& landmarks, model::LandmarkId id) {
  return std::lower_bound(
      landmarks.begin(), landmarks.end(), id,
      [](const model::MapLandmark& one, model::LandmarkId wanted) { return one.id < wanted; });
}

}  // namespace

model::MapDelta map_change(const std::vector<model::MapLandmark>& before,
                           const std::vector<model::MapLandmark>& changed,
                           const model::MapUpdate& update, const MapTolerance& tolerance) {
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
    } else if (has_moved(*old, landmark, tolerance)) {
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

void cut_to(const map_request_t& request, model::WholeMap& map) {
  const auto is_outside = [&](const Eigen::Vector2d& position) {
    return position.x() < request.min_m[0] || position.x() > request.max_m[0] ||
           position.y() < request.min_m[1] || position.y() > request.max_m[1];
  };
  std::erase_if(map.landmarks, [&](const auto& one) { return is_outside(one.position_m); });
  std::erase_if(map.keyframes,
                [&](const auto& one) { return is_outside(one.map_T_vehicle.translation()); });
  map.complete = false;
}

}  // namespace understory::geoslam_mapper
