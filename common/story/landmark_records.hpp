// Records of landmarks by id; the one that was not spoken of for longest gives way.
#pragma once

#include <cstdint>
#include <deque>
#include <unordered_map>

#include "common/story/landmark_record.hpp"

namespace understory::story {

/// Bounded store of records. Where bytes run short, the records that were not spoken of for longest
/// keep the newest of what happened to them only; where places do, they are forgotten.
class LandmarkRecords {
 public:
  /// Bytes of a landmark with the first block of each ring.
  static constexpr std::size_t landmark_bytes() {
    return kRecordBytes + 3 * Ring<Look>::kFirstBytes;
  }

  /// Keeps as many landmarks as go into `bytes`, at most `limit`, at least two.
  LandmarkRecords(std::size_t limit, std::size_t bytes);

  /// The record, now the newest; an empty one where the id is not known. Takes the place of the
  /// oldest where there are too many. Amortised O(1).
  LandmarkRecord& touch(model::LandmarkId id);
  /// The record, or null. O(1).
  const LandmarkRecord* find(model::LandmarkId id) const;
  /// Makes the record an empty one.
  void begin_again(LandmarkRecord& record);

  const std::deque<LandmarkRecord>& all() const { return records_; }  ///< In no order.
  std::uint64_t forgotten() const { return forgotten_; }              ///< Records that had to go.
  Budget& budget() { return budget_; }                                ///< For what the rings hold.
  std::size_t bytes() const { return budget_.used(); }                ///< Held now.

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;
  /// With its place in the index, and what the allocator adds.
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
  std::uint32_t trimmed_ = kNone;  ///< This one and all older ones hold first blocks only.
};

}  // namespace understory::story
