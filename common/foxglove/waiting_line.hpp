// Waiting messages of one topic for one client.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "common/foxglove/converter.hpp"

namespace understory::foxglove {

/// Limits of waiting messages. One message of any size may always wait.
struct LineBounds {
  std::size_t messages = 0;
  std::size_t bytes = 0;
};

/// First in, first out; drops by `Delivery`.
class WaitingLine {
 public:
  /// The queue of a topic without subscription: always empty.
  WaitingLine() = default;
  /// The queue of a subscribed topic; `needs_state`: it needs the state first.
  explicit WaitingLine(bool needs_state) : needs_state_(needs_state) {}

  /// Adds a message; `turn` counts arrivals of all topics. Returns the number of messages dropped
  /// for it, itself included.
  std::uint64_t offer(const Converted& message, std::uint64_t turn, const LineBounds& bounds);
  /// Arrival number of the first message; none = no message waits. A replacing message keeps the
  /// number of the replaced one.
  std::optional<std::uint64_t> turn() const;
  /// Takes out the first message. Precondition: a message waits.
  Converted pop();
  /// Bytes of all waiting messages.
  std::size_t bytes() const { return bytes_; }

  /// Whether the state is needed now. After a loss, only when the client has caught up (`is_slow`
  /// is false), otherwise another loss would follow.
  bool wants_state(bool is_slow) const { return needs_state_ && !(is_after_loss_ && is_slow); }
  /// The next message is the state. Returns whether a loss is the reason.
  bool expect_state();

 private:
  struct Waiting {
    std::uint64_t turn = 0;
    Converted message;
  };
  bool is_full_for(std::size_t bytes, const LineBounds& bounds) const;
  std::uint64_t make_room(std::size_t bytes, const LineBounds& bounds);
  std::uint64_t clear();

  std::deque<Waiting> queue_;
  std::size_t bytes_ = 0;
  bool needs_state_ = false;
  bool is_after_loss_ = false;
};

}  // namespace understory::foxglove
