// A small open-addressing table from 64-bit keys to 32-bit indices.
#pragma once

#include <cstdint>
#include <vector>

namespace understory::constellation {

/// Linear probing at a load of at most 5/8, keys and values side by side: a look-up usually touches
/// one cache line, and a search makes millions of look-ups. The table is never iterated, so its
/// order cannot reach an output. The key ~0 is reserved.
class IndexTable {
 public:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  /// An empty table.
  IndexTable() : entries_(kMinimum) {}

  /// The value of `key`, or kNone.
  std::uint32_t find(std::uint64_t key) const {
    for (std::size_t i = home(key);; i = (i + 1) & mask()) {
      if (entries_[i].key == key) return entries_[i].value;
      if (entries_[i].key == kFree) return kNone;
    }
  }
  /// Precondition: `key` is not in the table.
  void insert(std::uint64_t key, std::uint32_t value) {
    if (8 * (size_ + 1) > 5 * entries_.size()) grow();
    place(key, value);
    ++size_;
  }
  /// Removes `key` if it is there; closes the gap, so there are no tombstones.
  void erase(std::uint64_t key) {
    std::size_t hole = home(key);
    while (entries_[hole].key != key) {
      if (entries_[hole].key == kFree) return;
      hole = (hole + 1) & mask();
    }

    for (std::size_t i = (hole + 1) & mask(); entries_[i].key != kFree; i = (i + 1) & mask()) {
      const std::size_t wanted = home(entries_[i].key);
      if (((i - wanted) & mask()) >= ((i - hole) & mask())) {
        entries_[hole] = entries_[i];
        hole = i;
      }
    }

    entries_[hole].key = kFree;
    --size_;
  }
  /// Number of keys.
  std::size_t size() const { return size_; }
  /// Memory held [bytes].
  std::size_t bytes() const { return entries_.capacity() * sizeof(Entry); }

 private:
  static constexpr std::uint64_t kFree = ~std::uint64_t{0};
  static constexpr std::size_t kMinimum = 16;
  struct Entry {
    std::uint64_t key = kFree;
    std::uint32_t value = kNone;
  };

  std::size_t mask() const { return entries_.size() - 1; }
  std::size_t home(std::uint64_t key) const {
    const std::uint64_t mixed = (key ^ (key >> 31)) * 0x9E3779B97F4A7C15ULL;
    return (mixed ^ (mixed >> 32)) & mask();
  }
  void place(std::uint64_t key, std::uint32_t value) {
    std::size_t i = home(key);
    while (entries_[i].key != kFree) i = (i + 1) & mask();
    entries_[i] = {key, value};
  }
  void grow() {
    std::vector<Entry> old(2 * entries_.size());
    old.swap(entries_);
    for (const Entry& entry : old) {
      if (entry.key != kFree) place(entry.key, entry.value);
    }
  }

  std::vector<Entry> entries_;
  std::size_t size_ = 0;
};

}  // namespace understory::constellation
