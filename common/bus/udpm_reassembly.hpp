// Whole messages out of LCM's datagrams, whoever sends them and whatever is in them. No socket, no
// clock, no thread.
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

/// Who sent a datagram: IPv4 address and UDP port. One LCM instance is one sender.
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

/// How much may wait for its other fragments. Bookkeeping counts as well as payload.
struct ReassemblyLimits {
  /// One sender: the largest message in 65,535 fragments with 256 bytes of bookkeeping each. An
  /// honest sender finishes a message before it begins the next.
  std::size_t sender_bytes = kLargestMessage + (std::size_t{1} << 24U);
  /// All senders: one message of the largest size beside 64 MiB of others.
  std::size_t total_bytes = kLargestMessage + (std::size_t{1} << 26U);
  /// Half messages of one sender: packets that overtake each other need a few, loss leaves some.
  std::size_t messages_of_sender = 16;
  /// Senders with half messages: a few processes on a few computers, and spare ones.
  std::size_t senders = 256;
  /// Half messages are given up when no fragment has come for so long [us]. Fragments are sent
  /// without a pause; this covers a sender that lost its processor.
  std::int64_t stale_us = 2000000;
  /// Messages of one sender that were given or thrown away and of which more fragments may come.
  std::size_t settled_of_sender = 64;
};

/// Joins fragments of the channels that somebody wants; the others' are thrown away as soon as
/// fragment 0 has named the channel. Fragments of a message that was given already (two routes to
/// one group) are counted, not kept. When room is short the largest holder loses its oldest half
/// message, so nobody is pushed out who holds less than an equal share; a sender that comes when
/// the table is full takes the place of one that holds less than the newcomer brings, or is
/// refused.
class UdpmReassembler {
 public:
  /// A message; the views are valid until the next take() and as long as the datagram is.
  struct Message {
    std::string_view channel;
    std::span<const std::uint8_t> bytes;
  };
  /// Whether anybody listens to a channel.
  using Wanted = std::function<bool(std::string_view channel)>;
  /// What became of a datagram; neither = it is kept until the others come, or nobody wants it.
  struct Taken {
    std::optional<Message> message;
    std::optional<DatagramFault> fault;
  };

  /// Nothing waits. `wanted` is asked once for each message in fragments; none = all are wanted.
  explicit UdpmReassembler(ReassemblyLimits limits = {}, Wanted wanted = {})
      : limits_(limits), wanted_(std::move(wanted)) {}

  /// Takes one datagram; `now_us` by a clock that goes forward. A fault is counted. Throws
  /// std::bad_alloc, with nothing changed but what was dropped to make room. O(log fragments +
  /// bytes); O(senders) more where room is short.
  Taken take(std::span<const std::uint8_t> datagram, DatagramSender sender, std::int64_t now_us);

  /// What was refused or given up so far.
  const DatagramFaults& faults() const { return faults_; }
  /// What waits, with its bookkeeping [bytes].
  std::size_t held_bytes() const { return held_bytes_; }
  /// How many half messages wait.
  std::size_t held_messages() const;

 private:
  using Messages = std::map<std::uint32_t, PartialMessage>;  // by sequence number
  struct Settled {
    std::uint32_t sequence = 0;
    std::uint32_t message_size = 0;
    std::uint16_t count = 0;
    bool was_given = false;  // false: nobody wanted it
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
  std::string channel_;                // of the message given last
  std::vector<std::uint8_t> payload_;  // its bytes
  DatagramFaults faults_;
};

}  // namespace understory::bus
