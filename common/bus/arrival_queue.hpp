// A queue between the receiving and the handling thread.
#pragma once

#include <mutex>
#include <string_view>

#include "common/bus/dispatch_queue.hpp"

namespace understory::bus {

/// A DispatchQueue that one thread fills while another one handles; handlers run outside the lock
/// and may subscribe. A full subscription drops and counts its oldest message.
class ArrivalQueue {
 public:
  /// Throws std::system_error when no file descriptor is left.
  ArrivalQueue();
  ~ArrivalQueue();
  ArrivalQueue(const ArrivalQueue&) = delete;
  ArrivalQueue& operator=(const ArrivalQueue&) = delete;

  /// As DispatchQueue::subscribe().
  void subscribe(std::string_view channel, std::size_t queue_size, Bus::Handler handler);
  /// The same for all channels.
  void subscribe_all(std::size_t queue_size, Bus::Handler handler);
  /// Whether this channel, or all channels, are subscribed; from any thread.
  bool takes(std::string_view channel) const;
  /// Copies a message to its subscriptions; from any thread. If memory is exhausted, the message is
  /// counted as dropped.
  void push(std::string_view channel, std::span<const std::uint8_t> bytes,
            std::int64_t received_us) noexcept;
  /// Handles the oldest message; waits for one up to `timeout_ms`; false = none arrived. Exceptions
  /// of the handler pass through.
  bool handle_one(int timeout_ms);
  /// Messages of this channel that were dropped: from full queues, or for lack of memory (of any
  /// channel).
  std::uint64_t dropped(std::string_view channel) const;
  /// Messages dropped from the queues of subscribe_all(), or for lack of memory.
  std::uint64_t dropped_of_all() const;
  /// True when no message waits.
  bool empty() const;
  /// Readable while a message waits.
  int file_descriptor() const { return event_; }

 private:
  bool handle_now();

  mutable std::mutex mutex_;  // guards the members below, except the descriptor
  DispatchQueue queue_;
  std::uint64_t lost_for_memory_ = 0;
  int event_ = -1;
};

}  // namespace understory::bus
