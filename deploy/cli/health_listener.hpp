// HEALTH messages from the bus, checked before they are decoded.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "understory/health_t.hpp"

namespace understory {

class HealthListener {
 public:
  using Handler = std::function<void(const health_t&)>;
  /// Throws std::runtime_error naming the URL when the bus cannot be opened. An empty URL is LCM's
  /// own default.
  HealthListener(const std::string& lcm_url, Handler handler);
  ~HealthListener();
  HealthListener(const HealthListener&) = delete;
  HealthListener& operator=(const HealthListener&) = delete;

  /// Readable when a message waits; none is lost meanwhile but by a full buffer.
  int descriptor() const;
  /// Waits up to `timeout` for one message and hands it over; false when none came.
  bool handle(std::chrono::milliseconds timeout);
  /// Messages that were not of the type.
  std::uint64_t refused() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace understory
