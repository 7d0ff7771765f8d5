#include "common/bus/sequence_tracker.hpp"

#include <algorithm>

namespace understory::bus {
namespace {

/// A larger step is another sequence (or a hostile number), not a loss.
constexpr std::int64_t kLargestGap = 1000000;

std::size_t slot(std::int64_t sequence) {
  return static_cast<std::size_t>(sequence) % SequenceTracker::kWindow;
}

}  // namespace

Arrival SequenceTracker::take(std::int64_t sequence, std::int64_t utime) {
  ++counts_.messages;
  if (newest_sequence_ < 0) return begin(sequence, utime);

  // A smaller number with a newer stamp is no old message: the sender restarted its count.
  const bool restarted = (sequence <= newest_sequence_ && utime > newest_utime_) ||
                         sequence - newest_sequence_ > kLargestGap;
  if (restarted) {
    ++counts_.restarts;
    return begin(sequence, utime);
  }

  if (sequence <= newest_sequence_) return take_old(sequence);
  const std::int64_t missing = sequence - newest_sequence_ - 1;
  for (std::int64_t i =
           std::max(newest_sequence_ + 1, sequence - static_cast<std::int64_t>(kWindow));
       i < sequence; ++i) {
    taken_.reset(slot(i));
  }

  taken_.set(slot(sequence));
  newest_sequence_ = sequence;
  newest_utime_ = std::max(newest_utime_, utime);
  if (missing == 0) return Arrival::kNext;

  ++counts_.gaps;
  counts_.lost += static_cast<std::uint64_t>(missing);

  return Arrival::kAfterGap;
}

Arrival SequenceTracker::begin(std::int64_t sequence, std::int64_t utime) {
  resume(sequence, utime);
  // Earlier ones may still arrive.
  taken_.reset();
  taken_.set(slot(sequence));
  first_sequence_ = sequence;
  return Arrival::kFirst;
}

Arrival SequenceTracker::take_old(std::int64_t sequence) {
  const bool is_in_window = newest_sequence_ - sequence < static_cast<std::int64_t>(kWindow);
  if (is_in_window && taken_.test(slot(sequence))) {
    ++counts_.duplicates;
    return Arrival::kDuplicate;
  }
  if (is_in_window) {
    taken_.set(slot(sequence));
    if (sequence > first_sequence_ && counts_.lost > 0) --counts_.lost;
  }
  ++counts_.late;
  return Arrival::kLate;
}

void SequenceTracker::resume(std::int64_t newest_sequence, std::int64_t newest_utime) {
  newest_sequence_ = newest_sequence;
  newest_utime_ = newest_utime;
  first_sequence_ = -1;
  taken_.set();
}

}  // namespace understory::bus
