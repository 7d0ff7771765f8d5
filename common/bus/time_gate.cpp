#include "common/bus/time_gate.hpp"

#include <utility>

namespace understory::bus {

MessageClock::Verdict TimeGate::take(const BusMessage& message, std::int64_t utime,
                                     const ChannelPace& pace) {
  using Verdict = MessageClock::Verdict;
  const std::int64_t before = clock_.now();
  const Verdict verdict = clock_.take(utime, pace);

  // The waiting messages are wrong if this one does not prove them.
  const bool ends =
      verdict == Verdict::kQuarantined || (verdict == Verdict::kFine && !clock_.is_waiting());
  if (ends && !held_.empty()) wrong_ = std::exchange(held_, {});
  if (verdict == Verdict::kFine) return verdict;

  held_.push_back(
      {std::string(message.channel), {message.bytes.begin(), message.bytes.end()}, utime});
  if (verdict == Verdict::kJumped) clock_.resume(before);
  return verdict;
}

std::vector<HeldMessage> TimeGate::jumped() { return std::exchange(held_, {}); }

std::vector<HeldMessage> TimeGate::wrong() { return std::exchange(wrong_, {}); }

}  // namespace understory::bus
