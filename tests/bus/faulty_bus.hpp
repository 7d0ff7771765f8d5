// A bus that loses, repeats, holds back, swaps and damages what is published through it: seeded,
// and every fault counted.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "common/bus/bus.hpp"

namespace understory::test {

/// Probabilities per message, 0..1; at most one fault befalls a message.
struct FaultPlan {
  double drop = 0.0;
  double duplicate = 0.0;
  double delay = 0.0;  ///< Held back until `delay_messages` others have passed.
  std::size_t delay_messages = 10;
  double reorder = 0.0;  ///< Swapped with the next one.
  double corrupt = 0.0;  ///< One to eight bytes changed.
  double truncate = 0.0;
  double flood = 0.0;  ///< `flood_messages` packets of noise are sent before it.
  std::size_t flood_messages = 50;
  std::vector<std::string> channels;  ///< Only these; empty = all.
};

/// How many messages met which fault.
struct FaultCounts {
  std::uint64_t passed = 0;  ///< Untouched.
  std::uint64_t dropped = 0;
  std::uint64_t duplicated = 0;
  std::uint64_t delayed = 0;
  std::uint64_t reordered = 0;
  std::uint64_t corrupted = 0;
  std::uint64_t truncated = 0;
  std::uint64_t flood_packets = 0;
};

/// A bus around `inner` that applies a FaultPlan to what is published; what comes in is left alone.
class FaultyBus : public bus::Bus {
 public:
  /// `inner` must outlive it. The same seed and messages give the same faults.
  FaultyBus(bus::Bus& inner, FaultPlan plan, std::uint64_t seed)
      : inner_(inner), plan_(std::move(plan)), random_(seed) {}

  std::optional<wire::Refusal> publish(std::string_view channel,
                                       std::span<const std::uint8_t> bytes) override;
  void subscribe(std::string_view channel, std::size_t queue_size, Handler handler) override;
  bool handle_one(int timeout_ms) override;
  std::uint64_t dropped(std::string_view channel) const override;
  int file_descriptor() const override { return inner_.file_descriptor(); }
  bus::ReceiveBuffer receive_buffer() const override { return inner_.receive_buffer(); }
  bus::DatagramFaults refused_datagrams() const override { return inner_.refused_datagrams(); }

  /// Sends everything that is held back, in order.
  void flush();
  /// The faults so far.
  const FaultCounts& counts() const { return counts_; }

 private:
  struct Held {
    std::string channel;
    std::vector<std::uint8_t> bytes;
    std::size_t release_after = 0;  // of how many more messages
  };

  std::optional<wire::Refusal> send_damaged(std::string_view channel,
                                            std::vector<std::uint8_t> bytes, double chance);
  void flood(std::string_view channel);
  void release_due();

  bus::Bus& inner_;
  FaultPlan plan_;
  std::mt19937_64 random_;
  std::deque<Held> held_;
  FaultCounts counts_;
};

}  // namespace understory::test
