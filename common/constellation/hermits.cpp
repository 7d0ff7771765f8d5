#include "common/constellation/hermits.hpp"

namespace understory::constellation {
namespace {

/// Landmarks just beyond the radius are visited too and excluded by their squared distance. That is
/// equal from both ends, so each counts the other, or neither does.
constexpr double kGenerous = 1.0 + 1e-6;

}  // namespace

/// Calls f(slot, is near) for each other landmark within kAround * apart_m of `position_m`.
template <class F>
void Hermits::for_each_around(Slot slot, const Eigen::Vector2d& position_m, const PointGrid& grid,
                              F&& f) const {
  const double radius_m = kAround * apart_m_;
  grid.for_each_within(position_m.x(), position_m.y(), kGenerous * radius_m,
                       [&](Slot other, double squared) {
                         if (other == slot || squared > radius_m * radius_m) return;
                         f(other, squared < apart_m_ * apart_m_);
                       });
}

void Hermits::inserted(Slot slot, LandmarkId id, const PointGrid& grid) {
  if (slot >= seen_.size()) seen_.resize(slot + 1);
  Surroundings own;
  own.id = id;
  for_each_around(slot, grid.position(slot), grid, [&](Slot other, bool is_near) {
    own.near += is_near ? 1 : 0;
    ++own.around;
    seen_[other].near += is_near ? 1 : 0;
    ++seen_[other].around;
    settle(other, grid);
  });
  seen_[slot] = own;
  settle(slot, grid);
}

void Hermits::removed(Slot slot, const Eigen::Vector2d& position_m, const PointGrid& grid) {
  if (seen_[slot].is_member) net_.remove(slot);
  seen_[slot] = {};
  for_each_around(slot, position_m, grid, [&](Slot other, bool is_near) {
    seen_[other].near -= is_near ? 1 : 0;
    --seen_[other].around;
    settle(other, grid);
  });
}

void Hermits::moved(Slot slot, LandmarkId id, const Eigen::Vector2d& before_m,
                    const PointGrid& grid) {
  removed(slot, before_m, grid);
  inserted(slot, id, grid);
}

/// Adds the landmark to the net or removes it, by its surroundings.
void Hermits::settle(Slot slot, const PointGrid& grid) {
  Surroundings& one = seen_[slot];
  if (is_hermit(one) == one.is_member) return;
  one.is_member = !one.is_member;
  if (one.is_member) {
    net_.insert(slot, one.id, grid.position(slot));
  } else {
    net_.remove(slot);
  }
}

}  // namespace understory::constellation
