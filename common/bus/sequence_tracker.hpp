// What the sequence numbers of one channel show: losses, repetitions, late comers, restarts.
#pragma once

#include <bitset>
#include <cstdint>

namespace understory::bus {

/// What the sequence number of a message shows.
enum class Arrival : std::uint8_t {
  kFirst,      ///< Of this channel, or of a sender that started again.
  kNext,       ///< As expected.
  kAfterGap,   ///< Some before it are missing (yet).
  kDuplicate,  ///< Came before.
  kLate,       ///< Came after a later one.
};

/// Counts over the life of a tracker.
struct SequenceCounts {
  std::uint64_t messages = 0;  ///< All that came.
  std::uint64_t gaps = 0;      ///< Holes.
  std::uint64_t lost = 0;      ///< Messages missing in them: one that comes late is not lost.
  std::uint64_t duplicates = 0;
  std::uint64_t late = 0;
  std::uint64_t restarts = 0;  ///< The sender began a new sequence.
};

/// Exact as long as a message is late by fewer than kWindow messages.
class SequenceTracker {
 public:
  static constexpr std::size_t kWindow = 1024;  ///< [messages]

  /// Counts a message by its sequence number (>= 0) and stamp [us]. A number that is not larger
  /// than the newest, with a newer stamp, is a restarted sender; so is a step of more than a
  /// million.
  Arrival take(std::int64_t sequence, std::int64_t utime);
  /// The counts so far.
  const SequenceCounts& counts() const { return counts_; }

  /// Sequence number of the newest message taken, saved over restarts; -1 = none.
  std::int64_t newest_sequence() const { return newest_sequence_; }
  /// Newest stamp taken [us], saved over restarts; -1 = none.
  std::int64_t newest_utime() const { return newest_utime_; }
  /// Goes on behind this message; older ones count as duplicates. Counts are kept.
  void resume(std::int64_t newest_sequence, std::int64_t newest_utime);

 private:
  Arrival begin(std::int64_t sequence, std::int64_t utime);
  Arrival take_old(std::int64_t sequence);

  std::int64_t first_sequence_ = -1;  // of this sender; those before it are not counted as lost
  std::int64_t newest_sequence_ = -1;
  std::int64_t newest_utime_ = -1;
  std::bitset<kWindow> taken_;  // at sequence modulo kWindow, for the kWindow newest numbers
  SequenceCounts counts_;
};

}  // namespace understory::bus
