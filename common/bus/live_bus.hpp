// The bus between processes: LCM over UDP multicast.
#pragma once

#include <memory>
#include <string>

#include "common/bus/bus.hpp"
#include "common/bus/bus_error.hpp"

namespace understory::bus {

/// The socket buffer asked for [bytes]: with the 208 KiB that Debian gives unasked, one large
/// message in two is lost.
inline constexpr std::int64_t kWantedReceiveBuffer = 4194304;

/// The URL to use: `url`, or else LCM_DEFAULT_URL, or else LCM's default group; for udpm:// with
/// recv_buf_size and ttl=0 added where they are not stated. Nothing leaves the computer by
/// accident.
std::string complete_lcm_url(const std::string& url);

/// What the kernel grants a socket that asks for `wanted_bytes`.
std::int64_t granted_receive_buffer(std::int64_t wanted_bytes);

/// LCM on one multicast group. liblcm sends; what comes in over udpm:// passes our own checked
/// receiver, since liblcm's overruns on crafted datagrams. Other URLs go through liblcm both ways.
/// The group is joined by the first subscription, and then a thread receives.
class LiveBus : public Bus {
 public:
  /// Throws BusError where the URL or its route is wrong.
  explicit LiveBus(const std::string& url);
  ~LiveBus() override;

  std::optional<wire::Refusal> publish(std::string_view channel,
                                       std::span<const std::uint8_t> bytes) override;
  /// Throws BusError where the port belongs to another program, and names it.
  void subscribe(std::string_view channel, std::size_t queue_size, Handler handler) override;
  /// Subscribes to the messages of all channels, as subscribe() does to one. udpm:// only; throws
  /// BusError.
  void subscribe_all(std::size_t queue_size, Handler handler);
  bool handle_one(int timeout_ms) override;
  std::uint64_t dropped(std::string_view channel) const override;
  /// Dropped from the queues of subscribe_all() so far.
  std::uint64_t dropped_of_all() const;
  int file_descriptor() const override;
  ReceiveBuffer receive_buffer() const override;
  DatagramFaults refused_datagrams() const override;
  /// The URL in use, completed.
  const std::string& url() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace understory::bus
