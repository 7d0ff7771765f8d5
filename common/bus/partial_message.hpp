// A message of which not all fragments have come yet.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/datagram.hpp"

namespace understory::bus {

/// The fragments of one message, in any order. Memory follows what has come, never what a header
/// promises.
class PartialMessage {
 public:
  /// For the message that `first` is a part of; it is not added yet.
  explicit PartialMessage(const Fragment& first);

  /// Why the fragment does not belong to what is there; none = add() may take it. O(log fragments),
  /// and O(bytes) for one that is there already.
  std::optional<DatagramFault> check(const Fragment& fragment) const;
  /// Adds a fragment that check() let pass; `now_us` on any clock that goes forward.
  void add(const Fragment& fragment, std::int64_t now_us);

  /// All fragments are there, and with them every byte.
  bool is_complete() const { return fragments_ == count_; }
  /// All fragments are there and yet not all bytes: the headers lied.
  bool is_short() const { return is_complete() && payload_bytes_ != message_size_; }
  /// Of fragment 0; empty until it has come.
  const std::string& channel() const { return channel_; }
  /// The payload, in order, of a message that is complete; leaves nothing here. O(bytes).
  std::vector<std::uint8_t> take_payload();

  /// What this object holds, with its own bookkeeping [bytes].
  std::size_t held_bytes() const { return held_bytes_; }
  /// By how much held_bytes() grows with this fragment.
  static std::size_t cost(const Fragment& fragment);
  /// When the latest fragment came [us].
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
