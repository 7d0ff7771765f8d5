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

/// Most that is sent into the group of sweeps [bytes/s]: a burst fits into the receivers' sockets.
inline constexpr double kBulkBytesPerSecond = 60e6;

/// The URL to use: `url`, or else LCM_DEFAULT_URL, or else LCM's default group; for udpm:// with
/// recv_buf_size and ttl=0 added where they are not stated. Nothing leaves the computer by
/// accident.
std::string complete_lcm_url(const std::string& url);

/// Throws BusError where the completed URL lets other computers hear the bus, and send to it: LCM
/// knows no sender from another.
void require_closed_bus(const std::string& url);

/// What the kernel grants a socket that asks for `wanted_bytes`.
std::int64_t granted_receive_buffer(std::int64_t wanted_bytes);

/// Which multicast groups a LiveBus uses.
enum class Groups : std::uint8_t {
  kOne,       ///< Its own for every channel.
  kWithBulk,  ///< Bulk channels in the group beside it (`bulk_group.hpp`), paced.
};

/// LCM on a multicast group, and on the one beside it. liblcm sends; what comes in over udpm://
/// passes our own checked receiver, since liblcm's overruns on crafted datagrams. Other URLs go
/// through liblcm both ways, in one group. A group is joined by the first subscription of one of
/// its channels, and then a thread receives. Messages of both groups are handed out in the order in
/// which the kernel received them.
class LiveBus : public Bus {
 public:
  /// `bulk_bytes_per_s` > 0: most that is sent into the bulk group. Throws BusError where the URL
  /// or its route is wrong.
  explicit LiveBus(const std::string& url, Groups groups = Groups::kOne,
                   double bulk_bytes_per_s = kBulkBytesPerSecond);
  ~LiveBus() override;

  std::optional<wire::Refusal> publish(std::string_view channel,
                                       std::span<const std::uint8_t> bytes) override;
  /// Throws BusError where the port belongs to another program, and names it.
  void subscribe(std::string_view channel, std::size_t queue_size, Handler handler) override;
  /// Subscribes to the messages of all channels and joins all groups. udpm:// only; throws
  /// BusError.
  void subscribe_all(std::size_t queue_size, Handler handler);
  bool handle_one(int timeout_ms) override;
  std::uint64_t dropped(std::string_view channel) const override;
  /// Dropped from the queues of subscribe_all() so far.
  std::uint64_t dropped_of_all() const;
  int file_descriptor() const override;
  ReceiveBuffer receive_buffer() const override;
  DatagramFaults refused_datagrams() const override;
  /// The URL of the main group, completed.
  const std::string& url() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// Both groups of a live system: what processes use. Throws BusError.
std::unique_ptr<Bus> make_live_bus(const std::string& url);

}  // namespace understory::bus
