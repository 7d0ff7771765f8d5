// A bus within one process: for tests and for replay. Deterministic: no clock, no thread.
#pragma once

#include "common/bus/bus.hpp"
#include "common/bus/dispatch_queue.hpp"

namespace understory::bus {

/// A bus whose messages wait in queues of this process until handle_one() or drain().
class MemoryBus : public Bus {
 public:
  /// Whether queues are bounded as subscribed, or unbounded.
  enum class Queues : std::uint8_t { kBounded, kUnlimited };

  /// `tap` is called with every published message before its handlers.
  explicit MemoryBus(Queues queues = Queues::kBounded, Handler tap = {})
      : queues_(queues), tap_(std::move(tap)) {}

  std::optional<wire::Refusal> publish(std::string_view channel,
                                       std::span<const std::uint8_t> bytes) override;
  void subscribe(std::string_view channel, std::size_t queue_size, Handler handler) override;
  /// Never waits: all messages come from this process.
  bool handle_one(int timeout_ms) override;
  std::uint64_t dropped(std::string_view channel) const override;

  /// Handles messages until none waits.
  void drain();

 private:
  Queues queues_;
  Handler tap_;
  DispatchQueue queue_;
};

}  // namespace understory::bus
