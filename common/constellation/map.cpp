#include "common/constellation/map.hpp"

#include <algorithm>
#include <cmath>

namespace understory::constellation {
namespace {

constexpr LandmarkId kReservedId = ~LandmarkId{0};
/// Least distances of hermits from all others [m], for 0.08, 0.3 and 1.3 landmarks per square
/// metre.
constexpr std::array kApart_m{2.0, 1.0, 0.5};

}  // namespace

std::string_view describe(LocaliseOutcome outcome) {
  switch (outcome) {
    case LocaliseOutcome::kFound:
      return "found";
    case LocaliseOutcome::kTooFewPoints:
      return "fewer than three usable points";
    case LocaliseOutcome::kNoMatch:
      return "no hypothesis held";
    case LocaliseOutcome::kLikelyChance:
      return "too few hits to rule out chance";
    case LocaliseOutcome::kAmbiguous:
      return "a different pose fits nearly as well";
    case LocaliseOutcome::kGaveUp:
      return "gave up after the allowed number of look-ups";
  }

  return "unknown";
}

ConstellationMap::ConstellationMap(const Parameters& parameters)
    : grid_(parameters.cell_m), net_(parameters) {
  for (const double apart_m : kApart_m) hermits_.emplace_back(apart_m, parameters);
}

bool ConstellationMap::insert(LandmarkId id, const Eigen::Vector2d& position_m) {
  if (id == kReservedId || contains(id) || !PointGrid::representable(position_m)) return false;

  Slot slot = static_cast<Slot>(net_.slot_count());
  if (!free_slots_.empty()) {
    slot = free_slots_.back();
    free_slots_.pop_back();
  }
  slots_.insert(id, slot);
  grid_.insert(slot, position_m);
  net_.insert(slot, id, position_m);
  for (Hermits& each : hermits_) each.inserted(slot, id, net_.grid());
  return true;
}

bool ConstellationMap::remove(LandmarkId id) {
  const Slot slot = slots_.find(id);
  if (slot == kNoSlot) return false;
  const Eigen::Vector2d settled_m = net_.grid().position(slot);
  shifted_.erase(slot);
  grid_.remove(slot);
  net_.remove(slot);
  for (Hermits& each : hermits_) each.removed(slot, settled_m, net_.grid());
  slots_.erase(id);
  free_slots_.push_back(slot);
  return true;
}

bool ConstellationMap::move(LandmarkId id, const Eigen::Vector2d& position_m) {
  if (!shift(id, position_m)) return false;
  const Slot slot = slots_.find(id);
  settle(slot);
  shifted_.erase(slot);
  return true;
}

bool ConstellationMap::shift(LandmarkId id, const Eigen::Vector2d& position_m) {
  const Slot slot = slots_.find(id);
  if (slot == kNoSlot || !PointGrid::representable(position_m)) return false;
  grid_.move(slot, position_m);
  shifted_.insert(slot);
  return true;
}

void ConstellationMap::settle() {
  for (const Slot slot : shifted_) settle(slot);
  shifted_.clear();
}

/// Updates the landmark's triangles.
void ConstellationMap::settle(Slot slot) {
  const Eigen::Vector2d before_m = net_.grid().position(slot);
  net_.move(slot, grid_.position(slot));
  for (Hermits& each : hermits_) each.moved(slot, id_of(slot), before_m, net_.grid());
}

std::optional<Eigen::Vector2d> ConstellationMap::position(LandmarkId id) const {
  const Slot slot = slots_.find(id);
  if (slot == kNoSlot) return std::nullopt;
  return grid_.position(slot);
}

std::optional<NearestLandmark> ConstellationMap::nearest(const Eigen::Vector2d& point_m,
                                                         double radius_m) const {
  std::optional<NearestLandmark> best;
  for_each_within(point_m, radius_m, [&](LandmarkId id, const Eigen::Vector2d&, double distance) {
    if (!best || distance < best->distance_m || (distance == best->distance_m && id < best->id)) {
      best = {id, distance};
    }
  });
  return best;
}

std::vector<LandmarkId> ConstellationMap::near(const Disc& disc) const {
  std::vector<LandmarkId> ids;
  for_each_within(disc.centre_m, disc.radius_m,
                  [&](LandmarkId id, const Eigen::Vector2d&, double) { ids.push_back(id); });
  std::sort(ids.begin(), ids.end());
  return ids;
}

std::vector<std::array<LandmarkId, 3>> ConstellationMap::triangles() const {
  std::vector<std::array<LandmarkId, 3>> result;
  result.reserve(triangle_count());
  for (const auto& triangle : net_.triangles().all()) {
    std::array<LandmarkId, 3> ids{id_of(triangle[0]), id_of(triangle[1]), id_of(triangle[2])};
    std::sort(ids.begin(), ids.end());
    result.push_back(ids);
  }
  std::sort(result.begin(), result.end());
  return result;
}

std::size_t ConstellationMap::bytes() const {
  constexpr std::size_t kTreeNode = 40;
  std::size_t bytes = grid_.bytes() + net_.bytes() + slots_.bytes() +
                      free_slots_.capacity() * sizeof(Slot) + shifted_.size() * kTreeNode;
  for (const Hermits& each : hermits_) bytes += each.bytes();
  return bytes;
}

}  // namespace understory::constellation
