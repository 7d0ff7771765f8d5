// Memory for the blocks of numbers that come and go with every update.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <memory>
#include <new>
#include <unordered_map>
#include <utility>
#include <vector>

namespace understory::factor_graph::storage {

/// Blocks of T by size class, from chunks that are kept: once a working set has been reached,
/// taking and giving back asks the system for nothing. Of large blocks only a few wait in each
/// class and the others go back to the system: else a graph that is worked on for hours would come
/// to hold the most that each class ever needed. Blocks are aligned to 64 bytes and hold anything
/// at first.
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
  void give_back(T* block, std::size_t count) {
    const unsigned size_class = class_of(count);
    std::vector<T*>& free = free_[size_class];
    const std::size_t size = class_size(size_class);
    if (size > kLarge && free.size() >= kMostLarge) {
      large_.erase(block);
      bytes_ -= size * sizeof(T);
      return;
    }
    free.push_back(block);
  }

  /// Memory taken from the system now [bytes].
  std::size_t bytes() const { return bytes_; }

 private:
  static constexpr std::size_t kAlignment = 64;
  static constexpr std::size_t kUnit = kAlignment / sizeof(T);
  static constexpr std::size_t kChunk = std::size_t{1} << 15U;
  static constexpr std::size_t kLarge = kChunk / 4;  ///< Larger ones have chunks of their own.
  static constexpr std::size_t kMostLarge = 4;       ///< That wait in a class.
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
    if (size > kLarge) {
      std::unique_ptr<T, Free> chunk = new_chunk(size);
      T* block = chunk.get();
      large_.emplace(block, std::move(chunk));
      return block;
    }
    if (left_ < size) {
      chunks_.push_back(new_chunk(kChunk));
      next_ = chunks_.back().get();
      left_ = kChunk;
    }
    T* block = next_;
    next_ += size;
    left_ -= size;
    return block;
  }
  std::unique_ptr<T, Free> new_chunk(std::size_t size) {
    bytes_ += size * sizeof(T);
    return std::unique_ptr<T, Free>(
        static_cast<T*>(::operator new (size * sizeof(T), std::align_val_t{kAlignment})));
  }

  std::vector<std::unique_ptr<T, Free>> chunks_;
  std::unordered_map<const T*, std::unique_ptr<T, Free>> large_;
  std::array<std::vector<T*>, 160> free_;
  T* next_ = nullptr;
  std::size_t left_ = 0;
  std::size_t bytes_ = 0;
};

}  // namespace understory::factor_graph::storage
