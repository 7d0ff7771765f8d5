// A bus that is late: what a process publishes is held back, what it hears waits. Nothing is lost.
#pragma once

#include <deque>
#include <set>
#include <string>
#include <vector>

#include "common/bus/bus.hpp"

namespace understory::test {

/// A bus around `inner` for one process: a bridge that holds its messages back, or SIGSTOP. For
/// tests on a MemoryBus, whose queues must lose nothing.
class LateBus : public bus::Bus {
 public:
  /// `inner` must outlive it.
  explicit LateBus(bus::Bus& inner) : inner_(inner) {}

  /// From now on what is published on this channel waits.
  void hold(std::string channel) { held_channels_.insert(std::move(channel)); }
  /// From now on the process hears nothing: what comes for it waits, as in a socket's buffer.
  void stop() { is_stopped_ = true; }
  /// Nothing is held any more. All that waited comes in one burst, in its order: what the process
  /// hears is handled at once, before anything that follows from it.
  void go_on();

  std::optional<wire::Refusal> publish(std::string_view channel,
                                       std::span<const std::uint8_t> bytes) override;
  void subscribe(std::string_view channel, std::size_t queue_size, Handler handler) override;
  bool handle_one(int timeout_ms) override { return inner_.handle_one(timeout_ms); }
  std::uint64_t dropped(std::string_view channel) const override { return inner_.dropped(channel); }

 private:
  struct Waiting {
    std::string channel;
    std::vector<std::uint8_t> bytes;
    const Handler* handler = nullptr;  ///< Of what is heard; null of what is published.
  };

  bus::Bus& inner_;
  std::set<std::string, std::less<>> held_channels_;
  bool is_stopped_ = false;
  std::deque<Handler> handlers_;
  std::vector<Waiting> waiting_;
};

}  // namespace understory::test
