// Ring buffers of the latest values, in bounded memory.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <type_traits>

namespace understory::story {

/// A memory budget [bytes] shared by many owners.
class Budget {
 public:
  /// `limit` bytes in all.
  explicit Budget(std::size_t limit) : limit_(limit) {}
  /// Takes bytes if that many are left; false = nothing was taken.
  bool take_if_left(std::size_t bytes) {
    if (bytes > left()) return false;
    used_ += bytes;
    return true;
  }
  /// Takes bytes without a check.
  void take(std::size_t bytes) { used_ += bytes; }
  /// Gives bytes back.
  void give_back(std::size_t bytes) { used_ -= bytes; }
  std::size_t used() const { return used_; }                                ///< [bytes]
  std::size_t left() const { return used_ < limit_ ? limit_ - used_ : 0; }  ///< [bytes]

 private:
  std::size_t limit_;
  std::size_t used_ = 0;
};

/// The latest values of one owner among many. Starts without memory; its first block is always
/// granted, more while it is below its quota and the budget has room. Then the oldest values are
/// dropped.
template <class T>
class Ring {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// Bytes of the first block, with the allocator's overhead.
  static constexpr std::size_t kFirstBytes = 48;

  /// Appends; amortised O(1).
  void push(const T& value, std::uint32_t quota, Budget& budget) {
    if (size_ == capacity_) grow(std::max(quota, 1U), budget);
    if (size_ == capacity_) {
      values_[head_] = value;
      head_ = (head_ + 1) % capacity_;
    } else {
      values_[(head_ + size_++) % capacity_] = value;
    }
    ++total_;
  }
  /// Drops all values and resets the counts.
  void clear(Budget& budget) {
    if (capacity_ > 0) budget.give_back(bytes_of(capacity_));
    *this = Ring();
  }
  /// Shrinks to the first block, with the newest values.
  void trim(Budget& budget) {
    if (capacity_ <= kFirst) return;
    budget.give_back(bytes_of(capacity_) - bytes_of(kFirst));
    hold(kFirst);
  }

  std::uint32_t size() const { return size_; }              ///< Number of stored values.
  std::uint32_t dropped() const { return total_ - size_; }  ///< Number of dropped values.
  /// The value at this index; 0 = the oldest stored one.
  const T& operator[](std::uint32_t i) const { return values_[(head_ + i) % capacity_]; }
  /// The newest value. Precondition: not empty.
  const T& back() const { return (*this)[size_ - 1]; }

 private:
  static constexpr std::size_t kAllocatorBytes = 16;
  static constexpr std::uint32_t kFirst =
      static_cast<std::uint32_t>((kFirstBytes - kAllocatorBytes) / sizeof(T));
  static_assert(kFirst > 0);
  static std::size_t bytes_of(std::uint32_t capacity) {
    return kAllocatorBytes + capacity * sizeof(T);
  }

  void grow(std::uint32_t quota, Budget& budget) {
    if (capacity_ == 0) {
      budget.take(bytes_of(kFirst));
      return hold(kFirst);
    }
    if (capacity_ >= quota) return;
    const std::uint32_t wanted = std::min(quota, 2 * capacity_);
    if (budget.take_if_left(bytes_of(wanted) - bytes_of(capacity_))) hold(wanted);
  }
  /// Moves the newest values into a block of this capacity.
  void hold(std::uint32_t capacity) {
    auto values = std::make_unique<T[]>(capacity);
    const std::uint32_t kept = std::min(size_, capacity);
    for (std::uint32_t i = 0; i < kept; ++i) values[i] = (*this)[size_ - kept + i];
    values_ = std::move(values);
    capacity_ = capacity;
    size_ = kept;
    head_ = 0;
  }

  std::unique_ptr<T[]> values_;
  std::uint32_t capacity_ = 0;
  std::uint32_t head_ = 0;
  std::uint32_t size_ = 0;
  std::uint32_t total_ = 0;
};

/// The latest `limit` messages of a channel.
template <class T>
class History {
 public:
  /// Stores at most `limit` messages, at least one.
  explicit History(std::size_t limit) : limit_(std::max<std::size_t>(limit, 1)) {}
  /// Appends; drops the oldest one if there are too many.
  T& push(T value) {
    if (values_.size() == limit_) {
      values_.pop_front();
      ++dropped_;
    }
    values_.push_back(std::move(value));
    return values_.back();
  }
  std::size_t size() const { return values_.size(); }        ///< Number of stored messages.
  std::uint64_t dropped() const { return dropped_; }         ///< Number of dropped messages.
  std::uint64_t heard() const { return size() + dropped_; }  ///< Number of all received messages.
  /// The message at this index; 0 = the oldest stored one.
  const T& operator[](std::size_t i) const { return values_[i]; }
  /// The same for completion.
  T& at(std::size_t i) { return values_[i]; }

  /// The newest message for which `is_it` is true; null = none. O(stored).
  template <class IsIt>
  const T* newest(const IsIt& is_it) const {
    const auto found = std::find_if(values_.rbegin(), values_.rend(), is_it);
    return found == values_.rend() ? nullptr : &*found;
  }
  /// Memory of this many messages, with the blocks of a deque, without memory that they point to.
  static constexpr std::size_t bytes_of(std::size_t messages) {
    constexpr std::size_t kBlock = 512;
    constexpr std::size_t kOfBlock = 24;  // For the allocator, and for the list of blocks.
    constexpr std::size_t kInBlock = std::max<std::size_t>(1, kBlock / sizeof(T));
    return (messages + kInBlock - 1) / kInBlock * (kInBlock * sizeof(T) + kOfBlock);
  }
  std::size_t bytes() const { return bytes_of(size()); }  ///< The same for the stored ones.

  auto begin() const { return values_.begin(); }  ///< Oldest first.
  auto end() const { return values_.end(); }      ///< After the newest one.

 private:
  std::size_t limit_;
  std::uint64_t dropped_ = 0;
  std::deque<T> values_;
};

}  // namespace understory::story
