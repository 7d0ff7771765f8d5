// Messages that wait for their handlers: bounded per subscription, handed out in order of arrival.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "common/bus/bus.hpp"

namespace understory::bus {

/// The queues of all subscriptions of one bus.
class DispatchQueue {
 public:
  /// Adds a subscription of `channel` (exact name) that holds `queue_size` messages (0 = no limit).
  void subscribe(std::string_view channel, std::size_t queue_size, Bus::Handler handler);
  /// Copies a message to every subscription of the channel; where one is full, its oldest is
  /// dropped and counted.
  void push(std::string_view channel, std::span<const std::uint8_t> bytes,
            std::int64_t received_us);
  /// Calls the handler of the message that came first; false = nothing waits.
  bool handle_one();
  /// True when nothing waits.
  bool empty() const { return waiting_ == 0; }
  /// Messages dropped from the full queues of this channel so far.
  std::uint64_t dropped(std::string_view channel) const;

 private:
  struct Waiting {
    std::uint64_t ticket = 0;  // counts arrivals over all subscriptions
    std::int64_t received_us = 0;
    std::vector<std::uint8_t> bytes;
  };
  struct Subscription {
    std::string channel;
    std::size_t queue_size = 0;
    Bus::Handler handler;
    std::deque<Waiting> queue;
    std::uint64_t dropped = 0;
  };

  std::deque<Subscription> subscriptions_;  // a deque: handlers may subscribe while one runs
  std::uint64_t next_ticket_ = 0;
  std::size_t waiting_ = 0;
};

}  // namespace understory::bus
