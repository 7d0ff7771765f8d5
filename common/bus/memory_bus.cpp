#include "common/bus/memory_bus.hpp"

#include <utility>

namespace understory::bus {

std::optional<wire::Refusal> MemoryBus::publish(std::string_view channel,
                                                std::span<const std::uint8_t> bytes) {
  if (auto refusal = check_publishable(channel, bytes.size())) return refusal;
  if (tap_) tap_({channel, bytes, 0});
  queue_.push(channel, bytes, 0);
  return std::nullopt;
}

void MemoryBus::subscribe(std::string_view channel, std::size_t queue_size, Handler handler) {
  queue_.subscribe(channel, queues_ == Queues::kUnlimited ? 0 : queue_size, std::move(handler));
}

bool MemoryBus::handle_one(int /*timeout_ms*/) { return queue_.handle_one(); }

std::uint64_t MemoryBus::dropped(std::string_view channel) const { return queue_.dropped(channel); }

void MemoryBus::drain() {
  while (queue_.handle_one()) {
  }
}

}  // namespace understory::bus
