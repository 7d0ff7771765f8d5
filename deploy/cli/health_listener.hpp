// HEALTH messages from the bus, checked before they are decoded.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

#include "common/bus/live_bus.hpp"
#include "common/model/slam_output.hpp"
#include "understory/health_t.hpp"

namespace understory::cli {

/// Subscribes HEALTH on the bus; skips malformed messages.
class HealthListener {
 public:
  /// Called with each HEALTH message.
  using Handler = std::function<void(const health_t&)>;
  /// Throws BusError with the URL where the bus cannot be joined.
  HealthListener(const std::string& lcm_url, Handler handler);

  /// Subscribes SLAM_POSE too; `handler` is called with each valid message.
  void hear_poses(std::function<void(const model::SlamPose&)> handler);

  int descriptor() const { return bus_.file_descriptor(); }  ///< Readable when a message waits.
  /// Waits up to `timeout` for one message and handles it; false when none arrived.
  bool handle(std::chrono::milliseconds timeout);
  std::uint64_t refused() const { return refused_; }  ///< Number of malformed messages.

 private:
  bus::LiveBus bus_;
  std::uint64_t refused_ = 0;
};

}  // namespace understory::cli
