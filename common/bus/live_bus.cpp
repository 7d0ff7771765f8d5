#include "common/bus/live_bus.hpp"

#include <lcm/lcm.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cctype>
#include <cstdlib>
#include <set>
#include <utility>

#include "common/bus/dispatch_queue.hpp"

namespace understory::bus {
namespace {

/// liblcm reads a channel as a regular expression; a name shall be only itself.
std::string escaped(std::string_view channel) {
  std::string result;
  for (const char c : channel) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '_') result.push_back('\\');
    result.push_back(c);
  }
  return result;
}

/// What liblcm may hold for one channel while a handler runs, beyond our own queue; when that is
/// full too, the loss shows as a gap in the sequence.
int liblcm_capacity(std::size_t queue_size) { return static_cast<int>(4 * queue_size + 64); }

/// One handle_one() takes in at most this many, so that a flood cannot keep it from its handlers.
constexpr int kMostTakenAtOnce = 1024;

std::int64_t url_number(const std::string& url, const std::string& key) {
  const std::size_t at = url.find(key + "=");
  return at == std::string::npos ? 0 : std::atoll(url.c_str() + at + key.size() + 1);
}

}  // namespace

std::string complete_lcm_url(const std::string& url) {
  std::string result = url;
  // NOLINTNEXTLINE(concurrency-mt-unsafe): read once, before any thread exists.
  const char* fallback = std::getenv("LCM_DEFAULT_URL");
  if (result.empty() && fallback != nullptr) result = fallback;
  if (result.empty()) result = "udpm://239.255.76.67:7667";
  if (result.rfind("udpm://", 0) != 0) return result;
  const auto add = [&](const std::string& key, const std::string& value) {
    if (result.find(key + "=") != std::string::npos) return;
    result += (result.find('?') == std::string::npos ? "?" : "&") + key + "=" + value;
  };
  add("recv_buf_size", std::to_string(kWantedReceiveBuffer));
  add("ttl", "0");
  return result;
}

std::int64_t granted_receive_buffer(std::int64_t wanted_bytes) {
  const int socket_fd = ::socket(AF_INET, SOCK_DGRAM, 0);
  if (socket_fd < 0) return 0;
  const int wanted = static_cast<int>(wanted_bytes);
  ::setsockopt(socket_fd, SOL_SOCKET, SO_RCVBUF, &wanted, sizeof(wanted));
  int granted = 0;
  socklen_t size = sizeof(granted);
  ::getsockopt(socket_fd, SOL_SOCKET, SO_RCVBUF, &granted, &size);
  ::close(socket_fd);
  return granted / 2;  // the kernel reports twice what may be used
}

class LiveBus::Impl {
 public:
  explicit Impl(const std::string& url)
      : url_(complete_lcm_url(url)), lcm_(lcm_create(url_.c_str())) {
    if (lcm_ == nullptr) throw BusError(url_ + ": cannot join this bus");
    buffer_.wanted_bytes = url_number(url_, "recv_buf_size");
    buffer_.granted_bytes = granted_receive_buffer(buffer_.wanted_bytes);
  }
  ~Impl() { lcm_destroy(lcm_); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void subscribe(std::string_view channel, std::size_t queue_size, Handler handler) {
    queue_.subscribe(channel, queue_size, std::move(handler));
    if (!channels_.emplace(channel).second) return;
    lcm_subscription_t* subscription =
        lcm_subscribe(lcm_, escaped(channel).c_str(), &Impl::take_in, this);
    if (subscription == nullptr)
      throw BusError(url_ + ": cannot subscribe " + std::string(channel));
    lcm_subscription_set_queue_capacity(subscription, liblcm_capacity(queue_size));
  }

  /// Only copies: handlers run later, outside liblcm's frames, where they may throw.
  static void take_in(const lcm_recv_buf_t* buffer, const char* channel, void* self) noexcept {
    auto& impl = *static_cast<Impl*>(self);
    try {
      impl.queue_.push(channel, {static_cast<const std::uint8_t*>(buffer->data), buffer->data_size},
                       buffer->recv_utime);
    } catch (...) {
      ++impl.lost_for_memory_;
    }
  }

  bool handle_one(int timeout_ms) {
    for (int i = 0; i < kMostTakenAtOnce && lcm_handle_timeout(lcm_, 0) > 0; ++i) {
    }
    if (queue_.empty() && timeout_ms > 0) lcm_handle_timeout(lcm_, timeout_ms);
    return queue_.handle_one();
  }

  std::string url_;
  lcm_t* lcm_;
  ReceiveBuffer buffer_;
  DispatchQueue queue_;
  std::set<std::string, std::less<>> channels_;
  std::uint64_t lost_for_memory_ = 0;
};

LiveBus::LiveBus(const std::string& url) : impl_(std::make_unique<Impl>(url)) {}
LiveBus::~LiveBus() = default;

std::optional<wire::Refusal> LiveBus::publish(std::string_view channel,
                                              std::span<const std::uint8_t> bytes) {
  if (auto refusal = check_publishable(channel, bytes.size())) return refusal;
  if (lcm_publish(impl_->lcm_, std::string(channel).c_str(), bytes.data(),
                  static_cast<unsigned>(bytes.size())) != 0) {
    return wire::Refusal{wire::Reason::kNotSent,
                         "the socket refused " + std::to_string(bytes.size()) + " bytes"};
  }
  return std::nullopt;
}

void LiveBus::subscribe(std::string_view channel, std::size_t queue_size, Handler handler) {
  impl_->subscribe(channel, queue_size, std::move(handler));
}

bool LiveBus::handle_one(int timeout_ms) { return impl_->handle_one(timeout_ms); }

std::uint64_t LiveBus::dropped(std::string_view channel) const {
  return impl_->queue_.dropped(channel) + impl_->lost_for_memory_;
}

int LiveBus::file_descriptor() const { return lcm_get_fileno(impl_->lcm_); }

ReceiveBuffer LiveBus::receive_buffer() const { return impl_->buffer_; }

const std::string& LiveBus::url() const { return impl_->url_; }

}  // namespace understory::bus
