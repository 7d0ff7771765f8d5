// Memory for short-lived blocks of numbers.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <new>
#include <vector>

#include "common/factor_graph/storage/system_blocks.hpp"

namespace understory::factor_graph::storage {

/// Blocks of T. Small ones are parts of chunks that are kept, by size: after the working set is
/// reached, take() and give_back() need no system call. Larger ones are allocated from the system
/// and returned to it: if kept by size, they would sum up to the maximum of each size, which
/// doubles the memory for graphs in space. Blocks are not initialised.
template <typename T>
class BlockPool {
 public:
  BlockPool() = default;
  BlockPool(BlockPool&&) noexcept = default;
  BlockPool& operator=(BlockPool&&) noexcept = default;

  /// A block of at least `count` T, not initialised.
  T* take(std::size_t count) {
    const std::size_t units = units_of(count);
    if (units > kMostUnits) return static_cast<T*>(large_.take(count * sizeof(T)));
    std::vector<T*>& free = free_[units];
    if (free.empty()) return carve(units * kUnit);
    T* block = free.back();
    free.pop_back();
    return block;
  }
  /// Takes back a block of take(count).
  void give_back(T* block, std::size_t count) {
    const std::size_t units = units_of(count);
    if (units > kMostUnits) return large_.give_back(block, count * sizeof(T));
    free_[units].push_back(block);
  }

  /// Memory taken from the system now [bytes].
  std::size_t bytes() const { return chunks_.size() * kChunk * sizeof(T) + large_.bytes(); }

 private:
  static constexpr std::size_t kAlignment = 64;
  static constexpr std::size_t kUnit = kAlignment / sizeof(T);
  static constexpr std::size_t kMostUnits = 16;  ///< Largest small block: one kilobyte.
  static constexpr std::size_t kChunk = std::size_t{1} << 13U;
  struct Free {
    void operator()(T* chunk) const { ::operator delete (chunk, std::align_val_t{kAlignment}); }
  };

  static std::size_t units_of(std::size_t count) { return (count + kUnit - 1) / kUnit; }

  T* carve(std::size_t size) {
    if (left_ < size) {
      chunks_.emplace_back(
          static_cast<T*>(::operator new (kChunk * sizeof(T), std::align_val_t{kAlignment})));
      next_ = chunks_.back().get();
      left_ = kChunk;
    }
    T* block = next_;
    next_ += size;
    left_ -= size;
    return block;
  }

  std::vector<std::unique_ptr<T, Free>> chunks_;
  SystemBlocks large_;
  std::array<std::vector<T*>, kMostUnits + 1> free_;
  T* next_ = nullptr;
  std::size_t left_ = 0;
};

}  // namespace understory::factor_graph::storage
