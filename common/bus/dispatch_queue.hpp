// Messages that wait for their handlers: bounded per subscription, handed out in order of arrival.
#pragma once

#include <deque>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/bus.hpp"

namespace understory::bus {

/// The queues of all subscriptions of one bus.
class DispatchQueue {
 public:
  /// A message taken from the queue, and its handler.
  struct Delivery {
    std::string channel;
    std::vector<std::uint8_t> bytes;
    std::int64_t received_us = 0;
    const Bus::Handler* handler = nullptr;  ///< Valid as long as the queue is.
  };

  /// Each subscription stores at most `most_bytes` besides the newest message.
  explicit DispatchQueue(std::size_t most_bytes = std::numeric_limits<std::size_t>::max())
      : most_bytes_(most_bytes) {}

  /// Adds a subscription of `channel` (exact name) for at most `queue_size` waiting messages (0 =
  /// no limit).
  void subscribe(std::string_view channel, std::size_t queue_size, Bus::Handler handler);
  /// The same for the messages of all channels.
  void subscribe_all(std::size_t queue_size, Bus::Handler handler);
  /// Whether this channel, or all channels, are subscribed.
  bool takes(std::string_view channel) const;
  /// Copies a message to every subscription of the channel; where one is full, its oldest is
  /// dropped and counted.
  void push(std::string_view channel, std::span<const std::uint8_t> bytes,
            std::int64_t received_us);
  /// Takes out the oldest message; none = no message waits.
  std::optional<Delivery> take_one();
  /// Calls the handler of the oldest message; false = no message waits.
  bool handle_one();
  /// True when no message waits.
  bool empty() const { return waiting_ == 0; }
  /// Messages dropped from the full queues of this channel so far.
  std::uint64_t dropped(std::string_view channel) const;
  /// Messages dropped from the full queues of subscribe_all() so far.
  std::uint64_t dropped_of_all() const;

 private:
  struct Waiting {
    std::uint64_t ticket = 0;  // counts arrivals over all subscriptions
    std::int64_t received_us = 0;
    std::string channel;  // for subscriptions of all channels; else empty
    std::vector<std::uint8_t> bytes;
  };
  struct Subscription {
    std::string channel;  // empty: all
    std::size_t queue_size = 0;
    Bus::Handler handler;
    std::deque<Waiting> queue = {};
    std::size_t bytes = 0;  // of the queue
    std::uint64_t dropped = 0;
  };

  void drop_excess(Subscription& subscription);

  std::size_t most_bytes_;

  std::deque<Subscription> subscriptions_;  // a deque: handlers may subscribe while running
  std::uint64_t next_ticket_ = 0;
  std::size_t waiting_ = 0;
};

}  // namespace understory::bus
