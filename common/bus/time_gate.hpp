// Messages whose stamps wait for proof.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/bus/bus.hpp"
#include "common/bus/message_clock.hpp"

namespace understory::bus {

/// A copy of a message that waits.
struct HeldMessage {
  std::string channel;
  std::vector<std::uint8_t> bytes;
  std::int64_t utime = 0;

  /// Its view, valid as long as this is. Latency does not count: it is the pause, not the work.
  BusMessage view() const { return {channel, bytes, 0}; }
};

/// The clock of a service, with the messages that it does not believe yet: none is lost where time
/// really went on elsewhere. At most two wait.
class TimeGate {
 public:
  /// `largest_jump_us`: MessageClock's.
  explicit TimeGate(std::int64_t largest_jump_us) : clock_(largest_jump_us) {}

  /// Takes the stamp of a message [us]; see MessageClock::take. A message that waits is copied. At
  /// kJumped now() is still what it was: the messages of jumped() are to be fed again, this one
  /// among them.
  MessageClock::Verdict take(const BusMessage& message, std::int64_t utime,
                             const ChannelPace& pace);
  /// After kJumped: all that waited, in order, and the one that proved it.
  std::vector<HeldMessage> jumped();
  /// After any verdict: those that waited and were found wrong.
  std::vector<HeldMessage> wrong();

  /// Newest believed stamp [us]; -1 before the first.
  std::int64_t now() const { return clock_.now(); }
  /// Sets now().
  void resume(std::int64_t now) { clock_.resume(now); }

 private:
  MessageClock clock_;
  std::vector<HeldMessage> held_;
  std::vector<HeldMessage> wrong_;
};

}  // namespace understory::bus
