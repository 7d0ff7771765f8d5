// Sends messages onto the live bus.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace understory {

class LivePublisher {
 public:
  /// Throws std::runtime_error naming the URL when the bus cannot be opened. An empty URL is LCM's
  /// own default.
  explicit LivePublisher(const std::string& lcm_url);
  ~LivePublisher();
  LivePublisher(LivePublisher&&) noexcept;
  LivePublisher& operator=(LivePublisher&&) noexcept;

  /// Throws std::runtime_error naming the channel when the network refuses it.
  void publish(const std::string& channel, std::span<const std::uint8_t> bytes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace understory
