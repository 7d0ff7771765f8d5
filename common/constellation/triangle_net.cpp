#include "common/constellation/triangle_net.hpp"

#include <algorithm>
#include <cmath>

namespace understory::constellation {
namespace {

using SlotTriple = std::array<Slot, 3>;

SlotTriple ascending(Slot a, Slot b, Slot c) {
  if (a > b) std::swap(a, b);
  if (b > c) std::swap(b, c);
  if (a > b) std::swap(a, b);
  return {a, b, c};
}

/// The standard library compares arrays byte by byte.
bool before(const SlotTriple& a, const SlotTriple& b) {
  const std::uint64_t first = (std::uint64_t{a[0]} << 32) | a[1];
  const std::uint64_t second = (std::uint64_t{b[0]} << 32) | b[1];
  return first != second ? first < second : a[2] < b[2];
}

void sort_unique(std::vector<SlotTriple>& triangles) {
  std::sort(triangles.begin(), triangles.end(), before);
  const auto same = [](const SlotTriple& a, const SlotTriple& b) {
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
  };
  triangles.erase(std::unique(triangles.begin(), triangles.end(), same), triangles.end());
}

void sort_unique(std::vector<Slot>& slots) {
  std::sort(slots.begin(), slots.end());
  slots.erase(std::unique(slots.begin(), slots.end()), slots.end());
}

}  // namespace

TriangleNet::TriangleNet(const MapParameters& parameters)
    : parameters_(parameters), grid_(parameters.cell_m), triangles_(parameters.bucket_m) {}

bool TriangleNet::Neighbours::has(Slot wanted) const {
  for (std::uint32_t i = 0; i < count; ++i) {
    if (slot[i] == wanted) return true;
  }
  return false;
}

void TriangleNet::insert(Slot slot, LandmarkId id, const Eigen::Vector2d& position_m) {
  if (slot >= ids_.size()) {
    ids_.resize(slot + 1);
    neighbours_.resize(slot + 1);
  }
  ids_[slot] = id;

  std::vector<Slot> anchors{slot};
  collect_anchors(slot, position_m, anchors);
  update(slot, anchors, [&] { grid_.insert(slot, position_m); });
}

void TriangleNet::remove(Slot slot) {
  std::vector<Slot> anchors{slot};
  collect_anchors(slot, grid_.position(slot), anchors);
  update(
      slot, anchors, [&] { grid_.remove(slot); }, slot);
}

void TriangleNet::move(Slot slot, const Eigen::Vector2d& position_m) {
  std::vector<Slot> anchors{slot};
  collect_anchors(slot, grid_.position(slot), anchors);
  collect_anchors(slot, position_m, anchors);
  sort_unique(anchors);
  update(slot, anchors, [&] { grid_.move(slot, position_m); });
}

template <class Change>
void TriangleNet::update(Slot changed, std::vector<Slot>& anchors, Change&& change, Slot gone) {
  std::sort(anchors.begin(), anchors.end());
  std::vector<Neighbours> lists_before;
  lists_before.reserve(anchors.size());
  for (const Slot anchor : anchors) lists_before.push_back(neighbours_[anchor]);

  // Sides at the changed landmark are computed before it changes.
  const std::vector<SlotTriple> old_ends = triangles_at(changed, anchors);
  for (const SlotTriple& triangle : old_ends) triangles_.remove(canonical(triangle));
  change();

  for (const Slot anchor : anchors) {
    neighbours_[anchor] = anchor == gone ? Neighbours{} : nearest_neighbours(anchor);
  }
  for (const SlotTriple& triangle : triangles_at(changed, anchors)) {
    triangles_.add(canonical(triangle));
  }

  exchange_others(changed, anchors, lists_before);
}

void TriangleNet::exchange_others(Slot changed, const std::vector<Slot>& anchors,
                                  const std::vector<Neighbours>& lists_before) {
  // Only triangles matter that an anchor lost or gained.
  std::vector<SlotTriple> lost;
  std::vector<SlotTriple> gained;
  for (std::size_t i = 0; i < anchors.size(); ++i) {
    if (anchors[i] == changed) continue;
    collect_difference(anchors[i], lists_before[i], neighbours_[anchors[i]], changed, lost);
    collect_difference(anchors[i], neighbours_[anchors[i]], lists_before[i], changed, gained);
  }
  sort_unique(lost);
  sort_unique(gained);

  // A triangle exists as long as it is in the neighbourhood of one of its corners.
  const auto held_before = [&](Slot corner, const SlotTriple& triangle) {
    const auto it = std::lower_bound(anchors.begin(), anchors.end(), corner);
    const bool rewired = it != anchors.end() && *it == corner;
    return holds(corner,
                 rewired ? lists_before[static_cast<std::size_t>(it - anchors.begin())]
                         : neighbours_[corner],
                 triangle);
  };

  for (const SlotTriple& triangle : lost) {
    const bool held = std::any_of(triangle.begin(), triangle.end(), [&](Slot corner) {
      return holds(corner, neighbours_[corner], triangle);
    });
    if (!held) triangles_.remove(canonical(triangle));
  }

  for (const SlotTriple& triangle : gained) {
    const bool held = std::any_of(triangle.begin(), triangle.end(),
                                  [&](Slot corner) { return held_before(corner, triangle); });
    if (!held) triangles_.add(canonical(triangle));
  }
}

std::vector<TriangleNet::SlotTriple> TriangleNet::triangles_at(
    Slot corner, const std::vector<Slot>& anchors) const {
  std::vector<SlotTriple> triangles;
  triangles.reserve(64);
  for (const Slot anchor : anchors) {
    const Neighbours& list = neighbours_[anchor];
    if (anchor != corner && !list.has(corner)) continue;
    for (std::uint32_t i = 0; i < list.count; ++i) {
      for (std::uint32_t j = i + 1; j < list.count; ++j) {
        if (anchor != corner && list.slot[i] != corner && list.slot[j] != corner) continue;
        triangles.push_back(ascending(anchor, list.slot[i], list.slot[j]));
      }
    }
  }

  sort_unique(triangles);
  return triangles;
}

void TriangleNet::collect_difference(Slot anchor, const Neighbours& in, const Neighbours& out,
                                     Slot except, std::vector<SlotTriple>& triangles) {
  std::array<bool, kNeighbours> common{};
  for (std::uint32_t i = 0; i < in.count; ++i) common[i] = out.has(in.slot[i]);
  for (std::uint32_t i = 0; i < in.count; ++i) {
    for (std::uint32_t j = i + 1; j < in.count; ++j) {
      if ((common[i] && common[j]) || in.slot[i] == except || in.slot[j] == except) continue;
      triangles.push_back(ascending(anchor, in.slot[i], in.slot[j]));
    }
  }
}

void TriangleNet::collect_anchors(Slot slot, const Eigen::Vector2d& position,
                                  std::vector<Slot>& anchors) const {
  grid_.for_each_within(position.x(), position.y(), parameters_.max_neighbour_distance_m,
                        [&](Slot other, double squared) {
                          if (other == slot) return;
                          const Neighbours& list = neighbours_[other];
                          if (list.count < kNeighbours || list.has(slot)) {
                            anchors.push_back(other);
                            return;
                          }
                          const Slot last = list.slot[list.count - 1];
                          const double farthest =
                              (grid_.position(last) - grid_.position(other)).squaredNorm();
                          // At equal positions the lower ids count as nearer, so a new landmark
                          // does not change the neighbours of thousands at the same position.
                          if (squared == 0.0 && farthest == 0.0 && ids_[last] < ids_[slot]) return;
                          // Allow for rounding: an extra anchor only costs time.
                          if (squared <= farthest * (1.0 + 1e-9)) anchors.push_back(other);
                        });
}

TriangleNet::Neighbours TriangleNet::nearest_neighbours(Slot slot) const {
  struct Near {
    double squared;
    Slot slot;
  };

  std::array<Near, kNeighbours> best;
  std::uint32_t count = 0;
  const double limit = parameters_.max_neighbour_distance_m * parameters_.max_neighbour_distance_m;

  const auto closer = [this](const Near& a, const Near& b) {
    return a.squared < b.squared || (a.squared == b.squared && ids_[a.slot] < ids_[b.slot]);
  };

  const Eigen::Vector2d position = grid_.position(slot);
  grid_.for_each_outward(
      position.x(), position.y(),
      [&](Slot other, double squared) {
        const Near candidate{squared, other};
        if (other == slot || squared > limit) return;
        if (count == kNeighbours && !closer(candidate, best[count - 1])) return;
        std::uint32_t i = count < kNeighbours ? count++ : count - 1;
        for (; i > 0 && closer(candidate, best[i - 1]); --i) best[i] = best[i - 1];
        best[i] = candidate;
      },
      [&](double complete_m) {
        const double squared = complete_m * complete_m;
        return squared > limit || (count == kNeighbours && best[count - 1].squared < squared);
      });

  Neighbours result;
  result.count = count;
  for (std::uint32_t i = 0; i < count; ++i) result.slot[i] = best[i].slot;

  return result;
}

bool TriangleNet::holds(Slot anchor, const Neighbours& list, const SlotTriple& triangle) {
  return std::all_of(triangle.begin(), triangle.end(),
                     [&](Slot corner) { return corner == anchor || list.has(corner); });
}

Triangle TriangleNet::canonical(const SlotTriple& triangle) const {
  const auto corner = [this](Slot slot) { return Corner{slot, ids_[slot], grid_.position(slot)}; };
  return canonical_triangle(corner(triangle[0]), corner(triangle[1]), corner(triangle[2]));
}

std::size_t TriangleNet::bytes() const {
  return grid_.bytes() + triangles_.bytes() + ids_.capacity() * sizeof(LandmarkId) +
         neighbours_.capacity() * sizeof(Neighbours);
}

}  // namespace understory::constellation
