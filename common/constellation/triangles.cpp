#include "common/constellation/triangles.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace understory::constellation {

Triangle canonical_triangle(const Corner& a, const Corner& b, const Corner& c) {
  struct Opposite {
    const Corner* corner;
    double squared;
  };
  std::array<Opposite, 3> order{Opposite{&a, (b.position - c.position).squaredNorm()},
                                Opposite{&b, (c.position - a.position).squaredNorm()},
                                Opposite{&c, (a.position - b.position).squaredNorm()}};
  const auto before = [](const Opposite& l, const Opposite& r) {
    return l.squared > r.squared || (l.squared == r.squared && l.corner->id < r.corner->id);
  };
  if (before(order[1], order[0])) std::swap(order[0], order[1]);
  if (before(order[2], order[1])) std::swap(order[1], order[2]);
  if (before(order[1], order[0])) std::swap(order[0], order[1]);

  Triangle triangle;
  for (std::size_t i = 0; i < 3; ++i) {
    triangle.vertex[i] = order[i].corner->slot;
    triangle.side_m[i] = static_cast<float>(std::sqrt(order[i].squared));
  }
  const Eigen::Vector2d u = order[1].corner->position - order[0].corner->position;
  const Eigen::Vector2d v = order[2].corner->position - order[0].corner->position;
  triangle.left = u.x() * v.y() - u.y() * v.x() > 0.0;
  return triangle;
}

void TriangleIndex::add(const Triangle& triangle) {
  const std::uint64_t key = key_of(triangle.left, bins(triangle.side_m));
  std::uint32_t index = directory_.find(key);
  if (index == IndexTable::kNone) {
    if (free_buckets_.empty()) {
      index = static_cast<std::uint32_t>(buckets_.size());
      buckets_.emplace_back();
    } else {
      index = free_buckets_.back();
      free_buckets_.pop_back();
    }
    directory_.insert(key, index);
  }

  buckets_[index].push_back({triangle.side_m, triangle.vertex});
  ++size_;
}

void TriangleIndex::remove(const Triangle& triangle) {
  const std::uint64_t key = key_of(triangle.left, bins(triangle.side_m));
  const std::uint32_t index = directory_.find(key);
  assert(index != IndexTable::kNone);
  std::vector<Entry>& entries = buckets_[index];
  // Compare corner by corner: the standard library compares arrays byte by byte.
  const auto it = std::find_if(entries.begin(), entries.end(), [&](const Entry& entry) {
    return entry.vertex[0] == triangle.vertex[0] && entry.vertex[1] == triangle.vertex[1] &&
           entry.vertex[2] == triangle.vertex[2];
  });
  assert(it != entries.end());
  *it = entries.back();

  entries.pop_back();
  --size_;
  if (entries.empty()) {
    entries.shrink_to_fit();
    directory_.erase(key);
    free_buckets_.push_back(index);
  }
}

std::size_t TriangleIndex::bytes() const {
  std::size_t bytes = directory_.bytes() + buckets_.capacity() * sizeof(std::vector<Entry>);
  for (const auto& entries : buckets_) bytes += entries.capacity() * sizeof(Entry);
  return bytes;
}

std::vector<std::array<Slot, 3>> TriangleIndex::all() const {
  std::vector<std::array<Slot, 3>> triangles;
  triangles.reserve(size_);
  for (const auto& entries : buckets_) {
    for (const Entry& entry : entries) triangles.push_back(entry.vertex);
  }
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

}  // namespace understory::constellation
