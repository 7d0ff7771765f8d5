// Where the thread that receives meets the thread that handles.
#pragma once

#include <mutex>
#include <string_view>

#include "common/bus/dispatch_queue.hpp"

namespace understory::bus {

/// A DispatchQueue that one thread fills while another one handles; handlers run outside the lock
/// and may subscribe. Full subscriptions drop their oldest, and count.
class ArrivalQueue {
 public:
  /// Throws std::system_error when the process has no descriptor left.
  ArrivalQueue();
  ~ArrivalQueue();
  ArrivalQueue(const ArrivalQueue&) = delete;
  ArrivalQueue& operator=(const ArrivalQueue&) = delete;

  /// As DispatchQueue has it.
  void subscribe(std::string_view channel, std::size_t queue_size, Bus::Handler handler);
  /// The same for all channels.
  void subscribe_all(std::size_t queue_size, Bus::Handler handler);
  /// Whether anybody subscribed this channel, or all; from any thread.
  bool takes(std::string_view channel) const;
  /// Copies a message to who wants it; from any thread. A message for which there is no memory is
  /// counted as dropped.
  void push(std::string_view channel, std::span<const std::uint8_t> bytes,
            std::int64_t received_us) noexcept;
  /// Hands out the message that came first, after waiting for one up to `timeout_ms`; false = none
  /// came. What the handler throws comes out.
  bool handle_one(int timeout_ms);
  /// Dropped from the queues of this channel, or for want of memory on any.
  std::uint64_t dropped(std::string_view channel) const;
  /// Dropped from the queues of subscribe_all(), or for want of memory.
  std::uint64_t dropped_of_all() const;
  /// True when nothing waits.
  bool empty() const;
  /// Readable while a message waits.
  int file_descriptor() const { return event_; }

 private:
  bool handle_now();

  mutable std::mutex mutex_;  // guards what follows, but the descriptor
  DispatchQueue queue_;
  std::uint64_t lost_for_memory_ = 0;
  int event_ = -1;
};

}  // namespace understory::bus
