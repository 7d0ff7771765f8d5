#include "common/bus/split_bus.hpp"

#include <poll.h>
#include <sys/epoll.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <regex>
#include <thread>

#include "common/bus/live_bus.hpp"

namespace understory::bus {
namespace {

void watch(int epoll, int file) {
  if (file < 0) return;
  epoll_event event{};
  event.events = EPOLLIN;
  ::epoll_ctl(epoll, EPOLL_CTL_ADD, file, &event);
}

/// Publishes no faster than a rate: sleeps before a message when the ones before are too recent.
class PacedBus : public Bus {
 public:
  PacedBus(std::unique_ptr<Bus> bus, double bytes_per_s)
      : bus_(std::move(bus)), bytes_per_s_(bytes_per_s) {}

  std::optional<wire::Refusal> publish(std::string_view channel,
                                       std::span<const std::uint8_t> bytes) override {
    std::this_thread::sleep_until(free_);
    const auto taken =
        std::chrono::duration<double>(static_cast<double>(bytes.size()) / bytes_per_s_);
    free_ = std::max(free_, Time::clock::now()) + std::chrono::duration_cast<Time::duration>(taken);
    return bus_->publish(channel, bytes);
  }
  void subscribe(std::string_view channel, std::size_t queue_size, Handler handler) override {
    bus_->subscribe(channel, queue_size, std::move(handler));
  }
  bool handle_one(int timeout_ms) override { return bus_->handle_one(timeout_ms); }
  std::uint64_t dropped(std::string_view channel) const override { return bus_->dropped(channel); }
  int file_descriptor() const override { return bus_->file_descriptor(); }
  ReceiveBuffer receive_buffer() const override { return bus_->receive_buffer(); }
  DatagramFaults refused_datagrams() const override { return bus_->refused_datagrams(); }

 private:
  using Time = std::chrono::steady_clock::time_point;
  std::unique_ptr<Bus> bus_;
  double bytes_per_s_;
  Time free_;
};

}  // namespace

bool is_bulk_channel(std::string_view channel) {
  return channel.starts_with("RAW_SWEEP") || channel.starts_with("LIDAR_SWEEP");
}

std::string bulk_lcm_url(const std::string& lcm_url) {
  static const std::regex pattern(R"(udpm://(\d+\.\d+\.\d+\.)(\d+):(\d+)(.*))");
  std::smatch parts;
  if (!std::regex_match(lcm_url, parts, pattern)) return lcm_url;
  const int last = std::stoi(parts[2]);
  const int port = std::stoi(parts[3]);
  return "udpm://" + parts[1].str() + std::to_string(last < 255 ? last + 1 : last - 1) + ":" +
         std::to_string(port < 65535 ? port + 1 : port - 1) + parts[4].str();
}

SplitBus::SplitBus(std::unique_ptr<Bus> main, MakeBus make_bulk)
    : main_(std::move(main)),
      make_bulk_(std::move(make_bulk)),
      epoll_(::epoll_create1(EPOLL_CLOEXEC)) {
  watch(epoll_, main_->file_descriptor());
}

SplitBus::~SplitBus() { ::close(epoll_); }

Bus& SplitBus::bulk() {
  if (!bulk_) {
    bulk_ = make_bulk_();
    watch(epoll_, bulk_->file_descriptor());
  }
  return *bulk_;
}

Bus& SplitBus::bus_of(std::string_view channel) {
  return is_bulk_channel(channel) ? bulk() : *main_;
}

std::optional<wire::Refusal> SplitBus::publish(std::string_view channel,
                                               std::span<const std::uint8_t> bytes) {
  return bus_of(channel).publish(channel, bytes);
}

void SplitBus::subscribe(std::string_view channel, std::size_t queue_size, Handler handler) {
  bus_of(channel).subscribe(channel, queue_size, std::move(handler));
}

bool SplitBus::handle_one(int timeout_ms) {
  if (!bulk_) return main_->handle_one(timeout_ms);
  const auto try_both = [&] {
    Bus& first = bulk_slot_ ? *bulk_ : *main_;
    Bus& second = bulk_slot_ ? *main_ : *bulk_;
    bulk_slot_ = !bulk_slot_;
    return first.handle_one(0) || second.handle_one(0);
  };
  if (try_both()) return true;
  if (timeout_ms <= 0) return false;
  pollfd file{epoll_, POLLIN, 0};
  ::poll(&file, 1, timeout_ms);
  return try_both();
}

std::uint64_t SplitBus::dropped(std::string_view channel) const {
  if (!is_bulk_channel(channel)) return main_->dropped(channel);
  return bulk_ ? bulk_->dropped(channel) : 0;
}

DatagramFaults SplitBus::refused_datagrams() const {
  DatagramFaults faults = main_->refused_datagrams();
  if (bulk_) faults.add(bulk_->refused_datagrams());
  return faults;
}

std::unique_ptr<Bus> make_live_bus(const std::string& url, double bulk_bytes_per_s) {
  const std::string complete = complete_lcm_url(url);
  return std::make_unique<SplitBus>(
      std::make_unique<LiveBus>(complete), [complete, bulk_bytes_per_s] {
        return std::make_unique<PacedBus>(std::make_unique<LiveBus>(bulk_lcm_url(complete)),
                                          bulk_bytes_per_s);
      });
}

}  // namespace understory::bus
