#include "common/bus/dispatch_queue.hpp"

#include <utility>

namespace understory::bus {

std::optional<wire::Refusal> check_publishable(std::string_view channel, std::size_t bytes) {
  if (channel.empty() || channel.size() > kLongestChannelName) {
    return wire::Refusal{wire::Reason::kNotSent,
                         "channel name `" + std::string(channel) + "` must have 1 to " +
                             std::to_string(kLongestChannelName) + " bytes"};
  }
  if (bytes > kLargestMessage) {
    return wire::Refusal{wire::Reason::kNotSent,
                         std::to_string(bytes) + " bytes are more than a message holds"};
  }
  return std::nullopt;
}

void DispatchQueue::subscribe(std::string_view channel, std::size_t queue_size,
                              Bus::Handler handler) {
  subscriptions_.push_back({std::string(channel), queue_size, std::move(handler), {}, 0});
}

void DispatchQueue::push(std::string_view channel, std::span<const std::uint8_t> bytes,
                         std::int64_t received_us) {
  for (Subscription& subscription : subscriptions_) {
    if (subscription.channel != channel) continue;
    subscription.queue.push_back({next_ticket_++, received_us, {bytes.begin(), bytes.end()}});
    ++waiting_;
    if (subscription.queue_size == 0 || subscription.queue.size() <= subscription.queue_size) {
      continue;
    }
    subscription.queue.pop_front();
    --waiting_;
    ++subscription.dropped;
  }
}

bool DispatchQueue::handle_one() {
  Subscription* oldest = nullptr;
  for (Subscription& subscription : subscriptions_) {
    if (subscription.queue.empty()) continue;
    if (oldest == nullptr || subscription.queue.front().ticket < oldest->queue.front().ticket) {
      oldest = &subscription;
    }
  }

  if (oldest == nullptr) return false;
  const Waiting message = std::move(oldest->queue.front());
  oldest->queue.pop_front();
  --waiting_;
  oldest->handler({oldest->channel, message.bytes, message.received_us});

  return true;
}

std::uint64_t DispatchQueue::dropped(std::string_view channel) const {
  std::uint64_t sum = 0;
  for (const Subscription& subscription : subscriptions_) {
    if (subscription.channel == channel) sum += subscription.dropped;
  }
  return sum;
}

}  // namespace understory::bus
