// Holds messages whose stamps wait for proof.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/bus/bus.hpp"
#include "common/bus/message_clock.hpp"

namespace understory::bus {

/// A copy of a waiting message.
struct HeldMessage {
  std::string channel;
  std::vector<std::uint8_t> bytes;
  std::int64_t utime = 0;

  /// A view, valid as long as this object. It has no reception time: the wait must not count as
  /// latency.
  BusMessage view() const { return {channel, bytes, 0}; }
};

/// The clock of a service, and the messages that it does not believe yet: no message is lost if
/// time really jumped. At most two wait.
class TimeGate {
 public:
  /// `largest_jump_us`: limit of MessageClock.
  explicit TimeGate(std::int64_t largest_jump_us) : clock_(largest_jump_us) {}

  /// Takes the stamp of a message [us]; see MessageClock::take. A waiting message is copied. At
  /// kJumped, now() is still unchanged: the caller must handle all messages of jumped() again, this
  /// one included.
  MessageClock::Verdict take(const BusMessage& message, std::int64_t utime,
                             const ChannelPace& pace);
  /// After kJumped: all waiting messages in order, and the one that proved them.
  std::vector<HeldMessage> jumped();
  /// After any verdict: the waiting messages that proved wrong.
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
