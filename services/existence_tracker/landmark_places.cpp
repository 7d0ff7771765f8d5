#include "services/existence_tracker/landmark_places.hpp"

#include <algorithm>
#include <cmath>

namespace understory::existence_tracker {
namespace {

/// Side of a cell [m].
constexpr double kCellM = 50.0;
/// Positions farther from the map's origin are in the last cell; NaN is in cell 0.
constexpr double kLastCell = 1e9;

int cell_along(double metres) {
  const double cell = std::floor(metres / kCellM);
  return std::isfinite(cell) ? static_cast<int>(std::clamp(cell, -kLastCell, kLastCell)) : 0;
}

}  // namespace

void LandmarkPlaces::take(const model::WholeMap& map) {
  for (const model::MapLandmark& one : map.landmarks) place(one.id, one.position_m);
}

void LandmarkPlaces::take(const model::MapDelta& delta) {
  for (const model::MapLandmark& one : delta.added) place(one.id, one.position_m);
  for (const model::MapLandmark& one : delta.moved) place(one.id, one.position_m);
  for (const model::LandmarkId id : delta.removed) erase(id);
  for (const auto& [old_id, new_id] : delta.merged) erase(old_id);
}

std::optional<Eigen::Vector2d> LandmarkPlaces::at(model::LandmarkId id) const {
  const auto found = places_m_.find(id);
  if (found == places_m_.end()) return std::nullopt;
  return found->second;
}

std::vector<model::LandmarkId> LandmarkPlaces::near(const Eigen::Vector2d& place_m,
                                                    double radius_m) const {
  const Eigen::Vector2d reach_m = Eigen::Vector2d::Constant(radius_m);
  const Cell low = cell_of(place_m - reach_m), high = cell_of(place_m + reach_m);
  std::vector<model::LandmarkId> ids;
  for (int x = low.first; x <= high.first; ++x) {
    const auto last = cells_.upper_bound({x, high.second});
    for (auto cell = cells_.lower_bound({x, low.second}); cell != last; ++cell)
      for (const auto& [id, at_m] : cell->second)
        if ((at_m - place_m).norm() <= radius_m) ids.push_back(id);
  }
  std::ranges::sort(ids);
  return ids;
}

LandmarkPlaces::Cell LandmarkPlaces::cell_of(const Eigen::Vector2d& place_m) {
  return {cell_along(place_m.x()), cell_along(place_m.y())};
}

void LandmarkPlaces::place(model::LandmarkId id, const Eigen::Vector2d& place_m) {
  const auto [found, is_new] = places_m_.try_emplace(id, place_m);
  if (!is_new) leave_cell(id, std::exchange(found->second, place_m));
  cells_[cell_of(place_m)].emplace_back(id, place_m);
}

void LandmarkPlaces::erase(model::LandmarkId id) {
  const auto found = places_m_.find(id);
  if (found == places_m_.end()) return;
  leave_cell(id, found->second);
  places_m_.erase(found);
}

void LandmarkPlaces::leave_cell(model::LandmarkId id, const Eigen::Vector2d& place_m) {
  const auto found = cells_.find(cell_of(place_m));
  std::erase_if(found->second, [id](const auto& one) { return one.first == id; });
  if (found->second.empty()) cells_.erase(found);
}

void LandmarkPlaces::fill_cells() {
  cells_.clear();
  for (const auto& [id, place_m] : places_m_) cells_[cell_of(place_m)].emplace_back(id, place_m);
}

}  // namespace understory::existence_tracker
