#include "tests/bus/late_bus.hpp"

#include <utility>

namespace understory::test {

std::optional<wire::Refusal> LateBus::publish(std::string_view channel,
                                              std::span<const std::uint8_t> bytes) {
  if (!held_channels_.contains(channel)) return inner_.publish(channel, bytes);
  if (auto refusal = bus::check_publishable(channel, bytes.size())) return refusal;
  waiting_.push_back({std::string(channel), {bytes.begin(), bytes.end()}});
  return std::nullopt;
}

void LateBus::subscribe(std::string_view channel, std::size_t queue_size, Handler handler) {
  handlers_.push_back(std::move(handler));
  inner_.subscribe(
      channel, queue_size, [this, own = &handlers_.back()](const bus::BusMessage& message) {
        if (!is_stopped_) return (*own)(message);
        waiting_.push_back(
            {std::string(message.channel), {message.bytes.begin(), message.bytes.end()}, own});
      });
}

void LateBus::go_on() {
  held_channels_.clear();
  is_stopped_ = false;
  for (const Waiting& one : std::exchange(waiting_, {})) {
    if (one.handler != nullptr) {
      (*one.handler)({one.channel, one.bytes, 0});
    } else {
      inner_.publish(one.channel, one.bytes);
    }
  }
}

}  // namespace understory::test
