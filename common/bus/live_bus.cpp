#include "common/bus/live_bus.hpp"

#include <lcm/lcm.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cctype>
#include <cstdlib>
#include <set>
#include <utility>

#include "common/bus/arrival_queue.hpp"
#include "common/bus/bulk_group.hpp"
#include "common/bus/lcm_group.hpp"
#include "common/bus/udpm_receiver.hpp"

namespace understory::bus {
namespace {

/// liblcm reads a channel as a regular expression; a name must match only itself.
std::string escaped(std::string_view channel) {
  std::string result;
  for (const char c : channel) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '_') result.push_back('\\');
    result.push_back(c);
  }
  return result;
}

/// Messages that liblcm may store for one channel while a handler runs, beyond our own queue; if
/// that is full too, the loss appears as a gap in the sequence.
int liblcm_capacity(std::size_t queue_size) { return static_cast<int>(4 * queue_size + 64); }

/// One handle_one() receives at most this many messages, so that a flood cannot block the handlers.
constexpr int kMostTakenAtOnce = 1024;

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

void require_closed_bus(const std::string& url) {
  const std::string complete = complete_lcm_url(url);
  if (!is_udpm_url(complete) || parse_udpm_url(complete).ttl == 0) return;
  throw BusError(
      complete +
      ": with a TTL above 0 every computer of the network hears this bus and can send to "
      "it, a map or a pose among others. --open-bus if this network is the vehicle's "
      "own; else ttl=0");
}

std::int64_t granted_receive_buffer(std::int64_t wanted_bytes) {
  const int socket_fd = ::socket(AF_INET, SOCK_DGRAM, 0);
  if (socket_fd < 0) return 0;
  const int wanted = static_cast<int>(wanted_bytes);
  ::setsockopt(socket_fd, SOL_SOCKET, SO_RCVBUF, &wanted, sizeof(wanted));
  const std::int64_t granted = granted_buffer(socket_fd);
  ::close(socket_fd);
  return granted;
}

class LiveBus::Impl {
 public:
  Impl(const std::string& url, Groups groups, double bulk_bytes_per_s)
      : main_(complete_lcm_url(url)), pacer_(bulk_bytes_per_s) {
    if (!main_.udpm()) return;
    if (groups == Groups::kWithBulk) bulk_url_ = bulk_lcm_url(main_.url());
    buffer_.wanted_bytes = main_.udpm()->receive_buffer_bytes;
    buffer_.granted_bytes = granted_receive_buffer(buffer_.wanted_bytes);
  }

  std::optional<wire::Refusal> publish(std::string_view channel,
                                       std::span<const std::uint8_t> bytes) {
    if (!is_in_bulk(channel)) return main_.publish(channel, bytes);
    pacer_.wait_to_send(bytes.size());
    return bulk().publish(channel, bytes);
  }

  void subscribe(std::string_view channel, std::size_t queue_size, Handler handler) {
    queue_.subscribe(channel, queue_size, std::move(handler));
    if (main_.udpm()) return join(is_in_bulk(channel) ? bulk() : main_);
    if (!channels_.emplace(channel).second) return;
    lcm_subscription_t* subscription =
        lcm_subscribe(main_.lcm(), escaped(channel).c_str(), &Impl::take_in, this);
    if (subscription == nullptr)
      throw BusError(main_.url() + ": cannot subscribe " + std::string(channel));
    lcm_subscription_set_queue_capacity(subscription, liblcm_capacity(queue_size));
  }

  void subscribe_all(std::size_t queue_size, Handler handler) {
    if (!main_.udpm()) throw BusError(main_.url() + ": all channels can be had of udpm:// only");
    queue_.subscribe_all(queue_size, std::move(handler));
    join(main_);
    if (!bulk_url_.empty()) join(bulk());
  }

  bool handle_one(int timeout_ms) {
    if (main_.udpm()) return queue_.handle_one(timeout_ms);
    for (int i = 0; i < kMostTakenAtOnce && lcm_handle_timeout(main_.lcm(), 0) > 0; ++i) {
    }
    if (queue_.empty() && timeout_ms > 0) lcm_handle_timeout(main_.lcm(), timeout_ms);
    return queue_.handle_one(0);
  }

  int file_descriptor() const {
    // With udpm:// this call of liblcm would open a receiving socket of its own.
    return main_.udpm() ? queue_.file_descriptor() : lcm_get_fileno(main_.lcm());
  }

  const std::string& url() const { return main_.url(); }
  const ArrivalQueue& queue() const { return queue_; }
  ReceiveBuffer buffer() const { return buffer_; }
  DatagramFaults faults() const { return receiver_ ? receiver_->faults() : DatagramFaults{}; }

 private:
  bool is_in_bulk(std::string_view channel) const {
    return !bulk_url_.empty() && is_bulk_channel(channel);
  }
  LcmGroup& bulk() {
    if (!bulk_) bulk_.emplace(bulk_url_);
    return *bulk_;
  }

  /// A process that only sends does not join, so it does not receive all traffic.
  void join(LcmGroup& group) {
    if (group.is_joined) return;
    if (!receiver_) {
      receiver_ = std::make_unique<UdpmReceiver>(
          [this](std::string_view channel) { return queue_.takes(channel); },
          [this](std::string_view channel, std::span<const std::uint8_t> bytes,
                 std::int64_t received_us) { queue_.push(channel, bytes, received_us); });
    }
    const std::int64_t granted_bytes = receiver_->join(*group.udpm(), group.url());
    group.is_joined = true;
    if (&group == &main_) buffer_.granted_bytes = granted_bytes;
  }

  /// Only copies the message: handlers run later, outside liblcm's frames, so that they may throw.
  static void take_in(const lcm_recv_buf_t* buffer, const char* channel, void* self) noexcept {
    static_cast<Impl*>(self)->queue_.push(
        channel, {static_cast<const std::uint8_t*>(buffer->data), buffer->data_size},
        buffer->recv_utime);
  }

  LcmGroup main_;
  std::string bulk_url_;  // empty: bulk goes to the main group
  std::optional<LcmGroup> bulk_;
  Pacer pacer_;
  ReceiveBuffer buffer_;
  ArrivalQueue queue_;
  std::unique_ptr<UdpmReceiver> receiver_;       // declared after the queue that it fills
  std::set<std::string, std::less<>> channels_;  // subscribed with liblcm
};

LiveBus::LiveBus(const std::string& url, Groups groups, double bulk_bytes_per_s)
    : impl_(std::make_unique<Impl>(url, groups, bulk_bytes_per_s)) {}
LiveBus::~LiveBus() = default;

std::optional<wire::Refusal> LiveBus::publish(std::string_view channel,
                                              std::span<const std::uint8_t> bytes) {
  if (auto refusal = check_publishable(channel, bytes.size())) return refusal;
  return impl_->publish(channel, bytes);
}

void LiveBus::subscribe(std::string_view channel, std::size_t queue_size, Handler handler) {
  impl_->subscribe(channel, queue_size, std::move(handler));
}

void LiveBus::subscribe_all(std::size_t queue_size, Handler handler) {
  impl_->subscribe_all(queue_size, std::move(handler));
}

bool LiveBus::handle_one(int timeout_ms) { return impl_->handle_one(timeout_ms); }

std::uint64_t LiveBus::dropped(std::string_view channel) const {
  return impl_->queue().dropped(channel);
}

std::uint64_t LiveBus::dropped_of_all() const { return impl_->queue().dropped_of_all(); }

int LiveBus::file_descriptor() const { return impl_->file_descriptor(); }

ReceiveBuffer LiveBus::receive_buffer() const { return impl_->buffer(); }

DatagramFaults LiveBus::refused_datagrams() const { return impl_->faults(); }

const std::string& LiveBus::url() const { return impl_->url(); }

std::unique_ptr<Bus> make_live_bus(const std::string& url) {
  return std::make_unique<LiveBus>(url, Groups::kWithBulk);
}

}  // namespace understory::bus
