// A message with missing fragments.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/datagram.hpp"

namespace understory::bus {

/// The fragments of one message, in any order. Memory grows with the received bytes, never with the
/// size in a header.
class PartialMessage {
 public:
  /// Starts the message of `first`; does not add `first`.
  explicit PartialMessage(const Fragment& first);

  /// The fault of a fragment that contradicts the received ones; none = add() may take it. O(log
  /// fragments), and O(bytes) for a repeated fragment.
  std::optional<DatagramFault> check(const Fragment& fragment) const;
  /// Adds a fragment that check() accepted; `now_us` on any clock that goes forward.
  void add(const Fragment& fragment, std::int64_t now_us);

  /// Whether all fragments have arrived.
  bool is_complete() const { return fragments_ == count_; }
  /// All fragments have arrived but bytes are missing: the headers are wrong.
  bool is_short() const { return is_complete() && payload_bytes_ != message_size_; }
  /// Channel from fragment 0; empty before it arrives.
  const std::string& channel() const { return channel_; }
  /// Moves out the payload of a complete message. O(bytes).
  std::vector<std::uint8_t> take_payload();

  /// Memory of this object, bookkeeping included [bytes].
  std::size_t held_bytes() const { return held_bytes_; }
  /// Increase of held_bytes() by this fragment [bytes].
  static std::size_t cost(const Fragment& fragment);
  /// Arrival time of the latest fragment [us].
  std::int64_t touched_us() const { return touched_us_; }

 private:
  bool is_identical(const Fragment& fragment) const;

  std::uint32_t message_size_;
  std::uint16_t count_;
  std::string channel_;
  std::vector<bool> has_come_;                                // by number
  std::map<std::uint32_t, std::vector<std::uint8_t>> parts_;  // by offset, none empty
  std::uint32_t fragments_ = 0;
  std::size_t payload_bytes_ = 0;
  std::size_t held_bytes_;
  std::int64_t touched_us_ = 0;
};

}  // namespace understory::bus
