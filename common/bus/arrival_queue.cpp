#include "common/bus/arrival_queue.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace understory::bus {

// Limit of memory for each subscription in a flood of large messages [bytes].
ArrivalQueue::ArrivalQueue()
    : queue_(kLargestMessage), event_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (event_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
}

ArrivalQueue::~ArrivalQueue() { ::close(event_); }

void ArrivalQueue::subscribe(std::string_view channel, std::size_t queue_size,
                             Bus::Handler handler) {
  const std::lock_guard lock(mutex_);
  queue_.subscribe(channel, queue_size, std::move(handler));
}

void ArrivalQueue::subscribe_all(std::size_t queue_size, Bus::Handler handler) {
  const std::lock_guard lock(mutex_);
  queue_.subscribe_all(queue_size, std::move(handler));
}

bool ArrivalQueue::takes(std::string_view channel) const {
  const std::lock_guard lock(mutex_);
  return queue_.takes(channel);
}

void ArrivalQueue::push(std::string_view channel, std::span<const std::uint8_t> bytes,
                        std::int64_t received_us) noexcept {
  const std::lock_guard lock(mutex_);
  const bool was_empty = queue_.empty();
  try {
    queue_.push(channel, bytes, received_us);
  } catch (...) {
    ++lost_for_memory_;
  }
  if (was_empty && !queue_.empty()) ::eventfd_write(event_, 1);
}

bool ArrivalQueue::handle_now() {
  std::optional<DispatchQueue::Delivery> delivery;
  {
    const std::lock_guard lock(mutex_);
    delivery = queue_.take_one();
    eventfd_t count = 0;
    if (delivery && queue_.empty()) ::eventfd_read(event_, &count);
  }

  if (!delivery) return false;
  (*delivery->handler)({delivery->channel, delivery->bytes, delivery->received_us});
  return true;
}

bool ArrivalQueue::handle_one(int timeout_ms) {
  if (handle_now()) return true;
  if (timeout_ms <= 0) return false;
  pollfd file{event_, POLLIN, 0};
  ::poll(&file, 1, timeout_ms);
  return handle_now();
}

std::uint64_t ArrivalQueue::dropped(std::string_view channel) const {
  const std::lock_guard lock(mutex_);
  return queue_.dropped(channel) + lost_for_memory_;
}

std::uint64_t ArrivalQueue::dropped_of_all() const {
  const std::lock_guard lock(mutex_);
  return queue_.dropped_of_all() + lost_for_memory_;
}

bool ArrivalQueue::empty() const {
  const std::lock_guard lock(mutex_);
  return queue_.empty();
}

}  // namespace understory::bus
