#include "deploy/cli/health_listener.hpp"

#include <fmt/format.h>
#include <lcm/lcm.h>

#include <stdexcept>

#include "common/wire/guard.hpp"

namespace understory {

struct HealthListener::Impl {
  lcm_t* lcm = nullptr;
  Handler handler;
  std::uint64_t refused = 0;

  static void receive(const lcm_recv_buf_t* buffer, const char* /*channel*/, void* self) {
    auto& impl = *static_cast<Impl*>(self);
    const auto message =
        decode_bytes<health_t>({static_cast<const std::uint8_t*>(buffer->data), buffer->data_size});
    if (message) {
      impl.handler(*message);
    } else {
      ++impl.refused;
    }
  }
};

HealthListener::HealthListener(const std::string& lcm_url, Handler handler)
    : impl_(std::make_unique<Impl>()) {
  impl_->handler = std::move(handler);
  impl_->lcm = ::lcm_create(lcm_url.empty() ? nullptr : lcm_url.c_str());
  if (impl_->lcm == nullptr) {
    throw std::runtime_error(fmt::format("cannot open the bus {} (try: understory doctor)",
                                         lcm_url.empty() ? "(LCM's default)" : lcm_url));
  }
  auto* subscription = ::lcm_subscribe(impl_->lcm, "HEALTH", &Impl::receive, impl_.get());
  ::lcm_subscription_set_queue_capacity(subscription, 200);
}

HealthListener::~HealthListener() {
  if (impl_->lcm != nullptr) ::lcm_destroy(impl_->lcm);
}

int HealthListener::descriptor() const { return ::lcm_get_fileno(impl_->lcm); }

bool HealthListener::handle(std::chrono::milliseconds timeout) {
  return ::lcm_handle_timeout(impl_->lcm, static_cast<int>(timeout.count())) > 0;
}

std::uint64_t HealthListener::refused() const { return impl_->refused; }

}  // namespace understory
