#include "deploy/cli/live_publisher.hpp"

#include <fmt/format.h>
#include <lcm/lcm.h>

#include <stdexcept>

namespace understory {

struct LivePublisher::Impl {
  std::unique_ptr<lcm_t, decltype(&::lcm_destroy)> lcm{nullptr, &::lcm_destroy};
};

LivePublisher::LivePublisher(const std::string& lcm_url) : impl_(std::make_unique<Impl>()) {
  impl_->lcm.reset(::lcm_create(lcm_url.empty() ? nullptr : lcm_url.c_str()));
  if (!impl_->lcm) {
    throw std::runtime_error(fmt::format("cannot open the bus {} (try: understory doctor)",
                                         lcm_url.empty() ? "(LCM's default)" : lcm_url));
  }
}

LivePublisher::~LivePublisher() = default;
LivePublisher::LivePublisher(LivePublisher&&) noexcept = default;
LivePublisher& LivePublisher::operator=(LivePublisher&&) noexcept = default;

void LivePublisher::publish(const std::string& channel, std::span<const std::uint8_t> bytes) {
  const auto size = static_cast<unsigned int>(bytes.size());
  if (::lcm_publish(impl_->lcm.get(), channel.c_str(), bytes.data(), size) != 0) {
    throw std::runtime_error(fmt::format("channel {}: cannot be sent", channel));
  }
}

}  // namespace understory
