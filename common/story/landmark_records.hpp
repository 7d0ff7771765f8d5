// Records of landmarks by id; the least recently used one is dropped first.
#pragma once

#include <cstdint>
#include <deque>
#include <unordered_map>

#include "common/story/landmark_record.hpp"

namespace understory::story {

/// Bounded store of records. If memory is short, the least recently used records keep only their
/// newest events; if the number of records is too large, they are dropped.
class LandmarkRecords {
 public:
  /// Bytes of a landmark with the first block of each ring.
  static constexpr std::size_t landmark_bytes() {
    return kRecordBytes + 3 * Ring<Look>::kFirstBytes;
  }

  /// Stores as many landmarks as fit into `bytes`, at most `limit`, at least two.
  LandmarkRecords(std::size_t limit, std::size_t bytes);

  /// The record, marked as most recently used; a new one for an unknown id, which replaces the
  /// oldest if there are too many. Amortised O(1).
  LandmarkRecord& touch(model::LandmarkId id);
  /// The record, or null. O(1).
  const LandmarkRecord* find(model::LandmarkId id) const;
  /// Clears the record.
  void begin_again(LandmarkRecord& record);

  const std::deque<LandmarkRecord>& all() const { return records_; }  ///< Records in no order.
  std::uint64_t forgotten() const { return forgotten_; }  ///< Number of dropped records.
  Budget& budget() { return budget_; }                    ///< Memory budget of the rings.
  std::size_t bytes() const { return budget_.used(); }    ///< Memory held now [bytes].

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;
  /// Bytes of a record, its index entry and the allocator's overhead.
  static constexpr std::size_t kRecordBytes = sizeof(LandmarkRecord) + 80;
  std::uint32_t place_for(model::LandmarkId id);
  void make_room();
  void make_newest(std::uint32_t place);
  void unlink(std::uint32_t place);

  std::size_t limit_;
  Budget budget_;
  std::uint64_t forgotten_ = 0;
  std::deque<LandmarkRecord> records_;
  std::unordered_map<model::LandmarkId, std::uint32_t> place_of_;
  std::uint32_t newest_ = kNone;
  std::uint32_t oldest_ = kNone;
  std::uint32_t trimmed_ = kNone;  ///< This record and all older ones have only their first blocks.
};

}  // namespace understory::story
