// Losses, repetitions, late messages and restarts by the sequence numbers of one channel.
#pragma once

#include <bitset>
#include <cstdint>

namespace understory::bus {

/// Class of a message by its sequence number.
enum class Arrival : std::uint8_t {
  kFirst,      ///< The first of this channel, or of a restarted sender.
  kNext,       ///< The next number, as expected.
  kAfterGap,   ///< Earlier ones are missing (so far).
  kDuplicate,  ///< Received before.
  kLate,       ///< Received after a later one.
};

/// Counts since the tracker was made.
struct SequenceCounts {
  std::uint64_t messages = 0;  ///< Received messages.
  std::uint64_t gaps = 0;      ///< Gaps in the numbers.
  std::uint64_t lost = 0;      ///< Missing messages; a late one is not lost.
  std::uint64_t duplicates = 0;
  std::uint64_t late = 0;
  std::uint64_t restarts = 0;  ///< New sequences of the sender.
};

/// Exact if no message is late by kWindow messages or more.
class SequenceTracker {
 public:
  static constexpr std::size_t kWindow = 1024;  ///< [messages]

  /// Counts a message by its sequence number (>= 0) and stamp [us]. A number not above the newest,
  /// with a newer stamp, means a restarted sender; so does a step of more than a million.
  Arrival take(std::int64_t sequence, std::int64_t utime);
  /// The counts so far.
  const SequenceCounts& counts() const { return counts_; }

  /// Sequence number of the newest message taken, saved over restarts; -1 = none.
  std::int64_t newest_sequence() const { return newest_sequence_; }
  /// Newest stamp taken [us], saved over restarts; -1 = none.
  std::int64_t newest_utime() const { return newest_utime_; }
  /// Continues after this message; older ones count as duplicates. Counts are kept.
  void resume(std::int64_t newest_sequence, std::int64_t newest_utime);

 private:
  Arrival begin(std::int64_t sequence, std::int64_t utime);
  Arrival take_old(std::int64_t sequence);

  std::int64_t first_sequence_ = -1;  // of this sender; earlier messages are not counted as lost
  std::int64_t newest_sequence_ = -1;
  std::int64_t newest_utime_ = -1;
  std::bitset<kWindow> taken_;  // at sequence modulo kWindow, for the kWindow newest numbers
  SequenceCounts counts_;
};

}  // namespace understory::bus
