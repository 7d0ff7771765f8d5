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

/// Subscribed to HEALTH on the bus; decodes nothing that is malformed.
class HealthListener {
 public:
  /// Called with each HEALTH message.
  using Handler = std::function<void(const health_t&)>;
  /// Throws BusError naming the URL when the bus cannot be joined.
  HealthListener(const std::string& lcm_url, Handler handler);

  /// Hears SLAM_POSE, too; `handler` is called with each that decodes.
  void hear_poses(std::function<void(const model::SlamPose&)> handler);

  int descriptor() const { return bus_.file_descriptor(); }  ///< Readable when a message waits.
  /// Waits up to `timeout` for one message and handles it; false when none came.
  bool handle(std::chrono::milliseconds timeout);
  std::uint64_t refused() const { return refused_; }  ///< Messages that were not of the type.

 private:
  bus::LiveBus bus_;
  std::uint64_t refused_ = 0;
};

}  // namespace understory::cli
