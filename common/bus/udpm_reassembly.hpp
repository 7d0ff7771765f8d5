// Assembles LCM's datagrams to messages; safe against any sender and content. No socket, no clock,
// no thread.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/bus/bus.hpp"
#include "common/bus/datagram_fault.hpp"
#include "common/bus/partial_message.hpp"

namespace understory::bus {

/// The sender of a datagram: IPv4 address and UDP port. One LCM instance is one sender.
struct DatagramSender {
  std::uint32_t address = 0;  ///< Host byte order.
  std::uint16_t port = 0;
  /// One address and one port.
  bool operator==(const DatagramSender&) const = default;
  /// Order of the table of senders.
  bool operator<(const DatagramSender& other) const {
    return std::pair(address, port) < std::pair(other.address, other.port);
  }
};

/// Limits for incomplete messages. Bytes include bookkeeping.
struct ReassemblyLimits {
  /// For one sender: the largest message in 65,535 fragments with 256 bytes of bookkeeping each. An
  /// honest sender finishes a message before it begins the next.
  std::size_t sender_bytes = kLargestMessage + (std::size_t{1} << 24U);
  /// For all senders: one message of the largest size and 64 MiB of others.
  std::size_t total_bytes = kLargestMessage + (std::size_t{1} << 26U);
  /// Incomplete messages of one sender: some from reordered packets, some from loss.
  std::size_t messages_of_sender = 16;
  /// Senders with incomplete messages: a few processes on a few computers, with margin.
  std::size_t senders = 256;
  /// An incomplete message is dropped after this time without a fragment [us]. Fragments are sent
  /// without a pause; this covers a sender that was not scheduled.
  std::int64_t stale_us = 2000000;
  /// Messages of one sender that were delivered or dropped and of which more fragments may arrive.
  std::size_t settled_of_sender = 64;
};

/// Joins fragments of subscribed channels; those of other channels are dropped as soon as fragment
/// 0 has named the channel. Fragments of a message that was delivered already (two routes to one
/// group) are counted and dropped. When memory is short, the sender that uses most loses its oldest
/// incomplete message, so a sender below an equal share loses none. When the table is full, a new
/// sender replaces a sender that uses less than the new fragment needs, or is refused.
class UdpmReassembler {
 public:
  /// A message; the views are valid until the next take() and as long as the datagram is.
  struct Message {
    std::string_view channel;
    std::span<const std::uint8_t> bytes;
  };
  /// Whether a channel is subscribed.
  using Wanted = std::function<bool(std::string_view channel)>;
  /// The result of a datagram; neither = it waits for other fragments, or its channel is not
  /// subscribed.
  struct Taken {
    std::optional<Message> message;
    std::optional<DatagramFault> fault;
  };

  /// Starts empty. `wanted` is called once for each message in fragments; none = all are wanted.
  explicit UdpmReassembler(ReassemblyLimits limits = {}, Wanted wanted = {})
      : limits_(limits), wanted_(std::move(wanted)) {}

  /// Takes one datagram; `now_us` by a clock that goes forward. A fault is counted. Throws
  /// std::bad_alloc; then only messages dropped for memory have changed. O(log fragments + bytes);
  /// O(senders) more where memory is short.
  Taken take(std::span<const std::uint8_t> datagram, DatagramSender sender, std::int64_t now_us);

  /// Counts of refused and dropped datagrams so far.
  const DatagramFaults& faults() const { return faults_; }
  /// Memory of incomplete messages, bookkeeping included [bytes].
  std::size_t held_bytes() const { return held_bytes_; }
  /// Number of incomplete messages.
  std::size_t held_messages() const;

 private:
  using Messages = std::map<std::uint32_t, PartialMessage>;  // by sequence number
  struct Settled {
    std::uint32_t sequence = 0;
    std::uint32_t message_size = 0;
    std::uint16_t count = 0;
    bool was_given = false;  // false: its channel is not subscribed
    std::int64_t settled_us = 0;
  };
  struct Sender {
    Messages messages;
    std::deque<Settled> settled;  // the oldest first
    std::size_t held_bytes = 0;

    bool is_idle() const { return messages.empty() && settled.empty(); }
    const Settled* settled_message(const Fragment& fragment) const;
  };
  using Senders = std::map<DatagramSender, Sender>;

  Taken refuse(DatagramFault fault);
  Taken take_fragment(const Fragment& fragment, DatagramSender sender, std::int64_t now_us);
  std::optional<Taken> take_of_known(const Fragment& fragment, const Sender& sender);
  bool is_unwanted(const Fragment& fragment) const;
  void throw_away(const Fragment& fragment, DatagramSender sender, std::int64_t now_us);
  void settle(const Fragment& fragment, Sender& sender, bool was_given, std::int64_t now_us);
  Taken finish(Sender& sender, Messages::iterator message);
  bool make_place(const Fragment& fragment, DatagramSender sender);
  bool make_room(std::size_t bytes, Senders::iterator sender, std::uint32_t sequence);
  bool drop_oldest(Sender& sender, const std::uint32_t* spared);
  void drop(Sender& sender, Messages::iterator message);
  void drop_stale(std::int64_t now_us);

  ReassemblyLimits limits_;
  Wanted wanted_;
  Senders senders_;
  std::size_t held_bytes_ = 0;
  std::int64_t swept_us_ = 0;
  std::string channel_;                // of the message delivered last
  std::vector<std::uint8_t> payload_;  // its payload
  DatagramFaults faults_;
};

}  // namespace understory::bus
