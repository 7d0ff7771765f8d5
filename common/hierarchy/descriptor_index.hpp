// Finds descriptors within a distance of a given one.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "common/hierarchy/descriptor.hpp"

namespace understory::hierarchy {

/// A set of descriptors with the caller's keys; adding and removing one takes constant time. A
/// distance is at least the difference in any bin, so descriptors are stored in square cells over
/// the bins that vary most, and a query visits only the cells within its radius. Exact for every
/// radius; fastest up to about the size of a cell.
class DescriptorIndex {
 public:
  /// A descriptor found, by its key.
  struct Hit {
    std::uint32_t key = 0;
    float distance = 0.0F;  ///< As from hierarchy::distance().
  };

  /// `cell_size` in units of a descriptor's distance; > 0.
  explicit DescriptorIndex(float cell_size = 2.0F) : cell_size_(cell_size) {}

  /// Adds a descriptor in constant time. Precondition: `key` is not in the index.
  void insert(std::uint32_t key, const Descriptor& descriptor);
  /// `descriptor` is the one that `key` was inserted with. Returns whether it existed.
  bool erase(std::uint32_t key, const Descriptor& descriptor);

  /// Replaces `hits` by all within `radius` (inclusive), nearest first, ties by key.
  void within(const Descriptor& descriptor, float radius, std::vector<Hit>& hits) const;

  /// Number of descriptors.
  std::size_t size() const { return size_; }

 private:
  struct Entry {
    std::uint32_t key;
    Descriptor descriptor;
  };
  /// The mean radius, the elongation and the triangularity of a polygon.
  static constexpr std::array<std::size_t, 3> kBins{0, 2, 3};
  using Cell = std::array<std::int32_t, kBins.size()>;

  std::int32_t cell_of(float value) const;
  static std::uint64_t key_of(const Cell& cell);
  void scan(const std::vector<Entry>& entries, const Descriptor& descriptor, float radius,
            std::vector<Hit>& hits) const;

  float cell_size_;
  std::size_t size_ = 0;
  std::unordered_map<std::uint64_t, std::vector<Entry>> cells_;
};

}  // namespace understory::hierarchy
