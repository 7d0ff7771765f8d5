// A bus: bytes to and from named channels. Live over UDP multicast, or within one process.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/bus/datagram_fault.hpp"
#include "common/wire/result.hpp"

namespace understory::bus {

/// One received message; the views are valid during the handler only.
struct BusMessage {
  std::string_view channel;
  std::span<const std::uint8_t> bytes;
  std::int64_t received_us = 0;  ///< Wall clock; for HEALTH only, never for an algorithm. 0 = none.
};

/// Size of the socket's receive buffer, requested and granted; zeros where there is no socket.
struct ReceiveBuffer {
  std::int64_t wanted_bytes = 0;
  std::int64_t granted_bytes = 0;
};

/// Handlers run inside handle_one(), one at a time, in the order of arrival, and may publish. Their
/// exceptions pass through handle_one() and never through a C frame.
class Bus {
 public:
  /// Called with each message of a subscription.
  using Handler = std::function<void(const BusMessage&)>;
  virtual ~Bus() = default;

  /// Sends one message. It returns a refusal where the message was not sent: a channel name that is
  /// empty or longer than 63 bytes, a message over 2^28 bytes, a socket that fails.
  virtual std::optional<wire::Refusal> publish(std::string_view channel,
                                               std::span<const std::uint8_t> bytes) = 0;
  /// Subscribes to all messages of this channel, by its exact name. At most `queue_size` wait (0 =
  /// no limit); when the queue is full, the oldest is dropped and counted.
  virtual void subscribe(std::string_view channel, std::size_t queue_size, Handler handler) = 0;
  /// Receives waiting messages and handles one. False: none arrived within `timeout_ms`.
  virtual bool handle_one(int timeout_ms) = 0;
  /// Messages dropped from the queues of this channel so far.
  virtual std::uint64_t dropped(std::string_view channel) const = 0;
  /// A descriptor that is readable when a message may wait; -1 = the bus has none.
  virtual int file_descriptor() const { return -1; }
  /// The socket buffer of the bus, for HEALTH.
  virtual ReceiveBuffer receive_buffer() const { return {}; }
  /// Counts of refused datagrams from the network, by reason.
  virtual DatagramFaults refused_datagrams() const { return {}; }
};

inline constexpr std::size_t kLongestChannelName = 63;
inline constexpr std::size_t kLargestMessage = std::size_t{1} << 28U;

/// The reason why no bus can send this message; none = it can be sent.
std::optional<wire::Refusal> check_publishable(std::string_view channel, std::size_t bytes);

}  // namespace understory::bus
