// Memory for the blocks of numbers that come and go with every update.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <memory>
#include <vector>

namespace understory::factor_graph::storage {

/// Blocks of T by size class, from chunks that are kept: once a working set has been reached,
/// taking and giving back asks the system for nothing. Blocks are aligned to 64 bytes and hold
/// anything at first.
template <typename T>
class BlockPool {
 public:
  BlockPool() = default;
  BlockPool(BlockPool&&) noexcept = default;
  BlockPool& operator=(BlockPool&&) noexcept = default;

  /// A block of at least `count` T, not initialised.
  T* take(std::size_t count) {
    const unsigned size_class = class_of(count);
    std::vector<T*>& free = free_[size_class];
    if (!free.empty()) {
      T* block = free.back();
      free.pop_back();
      return block;
    }
    return carve(class_size(size_class));
  }
  /// Takes back a block of take(count).
  void give_back(T* block, std::size_t count) { free_[class_of(count)].push_back(block); }

  /// Memory taken from the system so far [bytes]; none is given back before the end.
  std::size_t bytes() const { return bytes_; }

 private:
  static constexpr std::size_t kAlignment = 64;
  static constexpr std::size_t kUnit = kAlignment / sizeof(T);
  static constexpr std::size_t kChunk = std::size_t{1} << 15U;
  struct Free {
    void operator()(T* chunk) const { ::operator delete (chunk, std::align_val_t{kAlignment}); }
  };

  /// Four classes per octave: a fifth of a block is wasted at most.
  static unsigned class_of(std::size_t count) {
    const std::size_t units = (count + kUnit - 1) / kUnit;
    if (units <= 4) return units == 0 ? 0 : static_cast<unsigned>(units - 1);
    const auto octave = static_cast<unsigned>(std::bit_width(units - 1)) - 1;
    const auto quarter = static_cast<unsigned>(((units - 1) >> (octave - 2)) & 3U);
    return 4 * (octave - 1) + quarter;
  }
  static std::size_t class_size(unsigned size_class) {
    if (size_class < 4) return (size_class + 1) * kUnit;
    const unsigned octave = size_class / 4 + 1;
    return ((std::size_t{5} + size_class % 4) << (octave - 2)) * kUnit;
  }

  T* carve(std::size_t size) {
    if (size > kChunk / 4) return new_chunk(size);
    if (left_ < size) {
      next_ = new_chunk(kChunk);
      left_ = kChunk;
    }
    T* block = next_;
    next_ += size;
    left_ -= size;
    return block;
  }
  T* new_chunk(std::size_t size) {
    T* chunk = static_cast<T*>(::operator new (size * sizeof(T), std::align_val_t{kAlignment}));
    chunks_.emplace_back(chunk);
    bytes_ += size * sizeof(T);
    return chunk;
  }

  std::vector<std::unique_ptr<T, Free>> chunks_;
  std::array<std::vector<T*>, 160> free_;
  T* next_ = nullptr;
  std::size_t left_ = 0;
  std::size_t bytes_ = 0;
};

}  // namespace understory::factor_graph::storage
