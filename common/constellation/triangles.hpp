// Triangles of landmarks, indexed by their side lengths.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/constellation/grid.hpp"
#include "common/constellation/table.hpp"

namespace understory::constellation {

/// A triangle in canonical order: vertex[0] lies opposite the longest side, vertex[2] opposite the
/// shortest. A rigid motion does not change side lengths; a mirror image inverts `left`.
struct Triangle {
  std::array<Slot, 3> vertex{};
  std::array<float, 3> side_m{};  ///< Longest, middle, shortest.
  bool left = false;              ///< vertex 0, 1, 2 turn left.
};

/// A landmark as a triangle's corner; position in any one frame [m].
struct Corner {
  Slot slot = kNoSlot;
  std::uint64_t id = 0;  ///< Breaks ties between equal sides.
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
};

/// The three corners in canonical order.
Triangle canonical_triangle(const Corner& a, const Corner& b, const Corner& c);

/// Triangles in buckets of side lengths (longest, middle, shortest) and chirality.
class TriangleIndex {
 public:
  /// A triangle as the index stores it, in canonical order.
  struct Entry {
    std::array<float, 3> side_m{};
    std::array<Slot, 3> vertex{};
  };

  /// An empty index with buckets of `bucket_m` [m] per side, > 0.
  explicit TriangleIndex(double bucket_m) : per_m_(static_cast<float>(1.0 / bucket_m)) {}

  /// Stores a triangle; constant time. Precondition: it is not in the index.
  void add(const Triangle& triangle);
  /// Precondition: exactly this triangle was added before.
  void remove(const Triangle& triangle);
  /// Number of triangles.
  std::size_t size() const { return size_; }
  /// Memory held [bytes].
  std::size_t bytes() const;

  /// Number of triangles in the bucket of `triangle`: a quick estimate of its number of candidates.
  std::size_t crowd(const Triangle& triangle) const {
    return bucket(key_of(triangle.left, bins(triangle.side_m))).size();
  }

  /// Calls f(entry) for every triangle of the same chirality whose sides differ from those of
  /// `triangle` by no more than `tolerance_m`, side by side; stops when f returns false.
  template <class F>
  bool for_each_similar(const Triangle& triangle, const std::array<float, 3>& tolerance_m,
                        F&& f) const {
    const auto low = bins({triangle.side_m[0] - tolerance_m[0], triangle.side_m[1] - tolerance_m[1],
                           triangle.side_m[2] - tolerance_m[2]});
    const auto high =
        bins({triangle.side_m[0] + tolerance_m[0], triangle.side_m[1] + tolerance_m[1],
              triangle.side_m[2] + tolerance_m[2]});
    for (std::uint32_t l = low[0]; l <= high[0]; ++l) {
      for (std::uint32_t m = low[1]; m <= std::min(high[1], l); ++m) {
        for (std::uint32_t s = low[2]; s <= std::min(high[2], m); ++s) {
          for (const Entry& entry : bucket(key_of(triangle.left, {l, m, s}))) {
            if (similar(entry, triangle, tolerance_m) && !f(entry)) return false;
          }
        }
      }
    }

    return true;
  }

  /// Every triangle, in canonical vertex order, for comparisons; sorted.
  std::vector<std::array<Slot, 3>> all() const;

 private:
  using Bins = std::array<std::uint32_t, 3>;
  static constexpr std::uint32_t kBinBits = 12;
  static constexpr std::uint32_t kMaxBin = (1U << kBinBits) - 1;

  Bins bins(const std::array<float, 3>& side_m) const {
    const auto bin = [this](float side) {
      const float scaled = side * per_m_;
      if (!(scaled > 0.0F)) return std::uint32_t{0};
      return scaled < static_cast<float>(kMaxBin) ? static_cast<std::uint32_t>(scaled) : kMaxBin;
    };
    return {bin(side_m[0]), bin(side_m[1]), bin(side_m[2])};
  }
  static std::uint64_t key_of(bool left, const Bins& bins) {
    return (std::uint64_t{left} << (3 * kBinBits)) | (std::uint64_t{bins[0]} << (2 * kBinBits)) |
           (std::uint64_t{bins[1]} << kBinBits) | bins[2];
  }
  static bool similar(const Entry& entry, const Triangle& triangle,
                      const std::array<float, 3>& tolerance_m) {
    return std::abs(entry.side_m[0] - triangle.side_m[0]) <= tolerance_m[0] &&
           std::abs(entry.side_m[1] - triangle.side_m[1]) <= tolerance_m[1] &&
           std::abs(entry.side_m[2] - triangle.side_m[2]) <= tolerance_m[2];
  }
  std::span<const Entry> bucket(std::uint64_t key) const {
    const std::uint32_t index = directory_.find(key);
    if (index == IndexTable::kNone) return {};
    return buckets_[index];
  }

  float per_m_;
  std::vector<std::vector<Entry>> buckets_;
  std::vector<std::uint32_t> free_buckets_;
  IndexTable directory_;
  std::size_t size_ = 0;
};

}  // namespace understory::constellation
