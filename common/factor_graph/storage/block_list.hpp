// A list that grows without moving its records.
#pragma once

#include <cstddef>
#include <memory>
#include <type_traits>
#include <vector>

namespace understory::factor_graph::storage {

/// Records in blocks of 64 kilobytes. A growing vector would copy all its records into newly
/// provided memory: a millisecond for some thousand records during an update. Blocks are freed with
/// the list.
template <typename T>
class BlockList {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// Number of records.
  std::size_t size() const { return size_; }
  /// True where there is none.
  bool empty() const { return size_ == 0; }
  /// The record with this index.
  const T& operator[](std::size_t at) const { return blocks_[at / kRecords][at % kRecords]; }
  /// The same for change. References stay valid while the record exists.
  T& operator[](std::size_t at) { return blocks_[at / kRecords][at % kRecords]; }

  /// Appends a record.
  void push_back(const T& record) {
    if (size_ == blocks_.size() * kRecords)
      blocks_.push_back(std::make_unique_for_overwrite<T[]>(kRecords));
    (*this)[size_++] = record;
  }
  /// Removes the last record. Precondition: not empty.
  void pop_back() { --size_; }
  /// Removes all records.
  void clear() { size_ = 0; }

 private:
  /// A power of two, so that access needs no division.
  static constexpr std::size_t records_of(std::size_t bytes) {
    std::size_t records = 1;
    while (2 * records * sizeof(T) <= bytes) records *= 2;
    return records;
  }
  static constexpr std::size_t kRecords = records_of(std::size_t{1} << 16U);

  std::vector<std::unique_ptr<T[]>> blocks_;
  std::size_t size_ = 0;
};

}  // namespace understory::factor_graph::storage
