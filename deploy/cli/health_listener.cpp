#include "deploy/cli/health_listener.hpp"

#include "common/wire/convert.hpp"

namespace understory::cli {

HealthListener::HealthListener(const std::string& lcm_url, Handler handler) : bus_(lcm_url) {
  bus_.subscribe("HEALTH", 200,
                 [this, handler = std::move(handler)](const bus::BusMessage& message) {
                   const auto health = wire::decode_bytes<health_t>(message.bytes);
                   if (health) {
                     handler(*health);
                   } else {
                     ++refused_;
                   }
                 });
}

void HealthListener::hear_poses(std::function<void(const model::SlamPose&)> handler) {
  bus_.subscribe("SLAM_POSE", 1,
                 [this, handler = std::move(handler)](const bus::BusMessage& message) {
                   const auto pose = wire::decode_message<model::SlamPose>(message.bytes);
                   if (pose) {
                     handler(*pose);
                   } else {
                     ++refused_;
                   }
                 });
}

bool HealthListener::handle(std::chrono::milliseconds timeout) {
  return bus_.handle_one(static_cast<int>(timeout.count()));
}

}  // namespace understory::cli
