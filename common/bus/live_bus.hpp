// The bus between processes: LCM over UDP multicast.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include "common/bus/bus.hpp"

namespace understory::bus {

/// The socket buffer asked for [bytes]: with the 208 KiB that Debian gives unasked, one large
/// message in two is lost.
inline constexpr std::int64_t kWantedReceiveBuffer = 4194304;

/// The bus cannot be joined; what() names the URL.
class BusError : public std::runtime_error {
 public:
  /// From the one-line message that what() gives.
  using std::runtime_error::runtime_error;
};

/// The URL to use: `url`, or else LCM_DEFAULT_URL, or else LCM's default group; for udpm:// with
/// recv_buf_size and ttl=0 added where they are not stated. Nothing leaves the computer by
/// accident.
std::string complete_lcm_url(const std::string& url);

/// What the kernel grants a socket that asks for `wanted_bytes`.
std::int64_t granted_receive_buffer(std::int64_t wanted_bytes);

/// LCM on one multicast group, through liblcm. Handlers run outside its C frames.
class LiveBus : public Bus {
 public:
  /// Throws BusError.
  explicit LiveBus(const std::string& url);
  ~LiveBus() override;

  std::optional<wire::Refusal> publish(std::string_view channel,
                                       std::span<const std::uint8_t> bytes) override;
  void subscribe(std::string_view channel, std::size_t queue_size, Handler handler) override;
  bool handle_one(int timeout_ms) override;
  std::uint64_t dropped(std::string_view channel) const override;
  int file_descriptor() const override;
  ReceiveBuffer receive_buffer() const override;
  /// The URL in use, completed.
  const std::string& url() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace understory::bus
