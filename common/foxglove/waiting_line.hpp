// The messages of one topic that wait for one client.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "common/foxglove/converter.hpp"

namespace understory::foxglove {

/// How much may wait. One message always may, however large it is.
struct LineBounds {
  std::size_t messages = 0;
  std::size_t bytes = 0;
};

/// First in, first out, and dropped as `Delivery` says.
class WaitingLine {
 public:
  /// Of a topic that nobody subscribed to: nothing waits.
  WaitingLine() = default;
  /// Of a topic that a client wants; `needs_state`: it needs the state first.
  explicit WaitingLine(bool needs_state) : needs_state_(needs_state) {}

  /// Puts a message in; `turn` counts arrivals of all topics. Gives the number of messages that
  /// were dropped for it, itself included.
  std::uint64_t offer(const Converted& message, std::uint64_t turn, const LineBounds& bounds);
  /// Arrival of the first message; none: nothing waits. One that replaced another has its turn.
  std::optional<std::uint64_t> turn() const;
  /// Takes out the first message. Precondition: there is one.
  Converted pop();
  /// Of all that wait.
  std::size_t bytes() const { return bytes_; }

  /// Whether the state is needed now. After a loss that is only once the client has caught up
  /// (`is_slow` is false): else one loss would follow another.
  bool wants_state(bool is_slow) const { return needs_state_ && !(is_after_loss_ && is_slow); }
  /// The state comes next. Gives whether that is because of a loss.
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
