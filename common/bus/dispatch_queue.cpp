#include "common/bus/dispatch_queue.hpp"

#include <algorithm>
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
  subscriptions_.push_back({std::string(channel), queue_size, std::move(handler)});
}

void DispatchQueue::subscribe_all(std::size_t queue_size, Bus::Handler handler) {
  subscriptions_.push_back({{}, queue_size, std::move(handler)});
}

bool DispatchQueue::takes(std::string_view channel) const {
  return std::ranges::any_of(subscriptions_, [&](const Subscription& one) {
    return one.channel.empty() || one.channel == channel;
  });
}

void DispatchQueue::push(std::string_view channel, std::span<const std::uint8_t> bytes,
                         std::int64_t received_us) {
  for (Subscription& subscription : subscriptions_) {
    const bool takes_all = subscription.channel.empty();
    if (!takes_all && subscription.channel != channel) continue;
    subscription.queue.push_back({next_ticket_++,
                                  received_us,
                                  takes_all ? std::string(channel) : std::string(),
                                  {bytes.begin(), bytes.end()}});
    subscription.bytes += bytes.size();
    ++waiting_;
    drop_excess(subscription);
  }
}

void DispatchQueue::drop_excess(Subscription& subscription) {
  const auto is_full = [&] {
    const bool has_many =
        subscription.queue_size != 0 && subscription.queue.size() > subscription.queue_size;
    return has_many || (subscription.bytes > most_bytes_ && subscription.queue.size() > 1);
  };

  while (is_full()) {
    subscription.bytes -= subscription.queue.front().bytes.size();
    subscription.queue.pop_front();
    --waiting_;
    ++subscription.dropped;
  }
}

std::optional<DispatchQueue::Delivery> DispatchQueue::take_one() {
  Subscription* oldest = nullptr;
  for (Subscription& subscription : subscriptions_) {
    if (subscription.queue.empty()) continue;
    if (oldest == nullptr || subscription.queue.front().ticket < oldest->queue.front().ticket) {
      oldest = &subscription;
    }
  }

  if (oldest == nullptr) return std::nullopt;
  Waiting message = std::move(oldest->queue.front());
  oldest->queue.pop_front();
  oldest->bytes -= message.bytes.size();
  --waiting_;

  if (message.channel.empty()) message.channel = oldest->channel;
  return Delivery{std::move(message.channel), std::move(message.bytes), message.received_us,
                  &oldest->handler};
}

bool DispatchQueue::handle_one() {
  const auto delivery = take_one();
  if (!delivery) return false;
  (*delivery->handler)({delivery->channel, delivery->bytes, delivery->received_us});
  return true;
}

std::uint64_t DispatchQueue::dropped(std::string_view channel) const {
  std::uint64_t sum = 0;
  for (const Subscription& subscription : subscriptions_) {
    if (!channel.empty() && subscription.channel == channel) sum += subscription.dropped;
  }
  return sum;
}

std::uint64_t DispatchQueue::dropped_of_all() const {
  std::uint64_t sum = 0;
  for (const Subscription& subscription : subscriptions_) {
    if (subscription.channel.empty()) sum += subscription.dropped;
  }
  return sum;
}

}  // namespace understory::bus
