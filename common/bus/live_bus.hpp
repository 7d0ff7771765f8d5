// The bus between processes: LCM over UDP multicast.
#pragma once

#include <memory>
#include <string>

#include "common/bus/bus.hpp"
#include "common/bus/bus_error.hpp"

namespace understory::bus {

/// Requested size of the socket buffer [bytes]: with Debian's default of 208 KiB every second large
/// message is lost.
inline constexpr std::int64_t kWantedReceiveBuffer = 4194304;

/// Largest rate in the group of sweeps [bytes/s]: a burst then fits into the receivers' socket
/// buffers.
inline constexpr double kBulkBytesPerSecond = 60e6;

/// The URL to use: `url`, or else LCM_DEFAULT_URL, or else LCM's default group; for udpm:// with
/// recv_buf_size and ttl=0 where they are not stated, so that nothing leaves the computer by
/// accident.
std::string complete_lcm_url(const std::string& url);

/// Throws BusError where the completed URL lets other computers receive and send on the bus: LCM
/// does not authenticate senders.
void require_closed_bus(const std::string& url);

/// The receive buffer that the kernel grants for a request of `wanted_bytes`.
std::int64_t granted_receive_buffer(std::int64_t wanted_bytes);

/// The multicast groups of a LiveBus.
enum class Groups : std::uint8_t {
  kOne,       ///< One group for all channels.
  kWithBulk,  ///< Bulk channels in the group beside it (`bulk_group.hpp`), paced.
};

/// LCM on a multicast group, and on the one beside it. liblcm sends; udpm:// messages are received
/// by our own receiver, because liblcm's receiver overruns its buffers on crafted datagrams. Other
/// URLs go through liblcm both ways, in one group. A group is joined by the first subscription of
/// one of its channels, and then a thread receives. Messages of both groups are handed out in the
/// order in which the kernel received them.
class LiveBus : public Bus {
 public:
  /// `bulk_bytes_per_s` > 0: largest rate in the bulk group. Throws BusError where the URL or its
  /// route is wrong.
  explicit LiveBus(const std::string& url, Groups groups = Groups::kOne,
                   double bulk_bytes_per_s = kBulkBytesPerSecond);
  ~LiveBus() override;

  std::optional<wire::Refusal> publish(std::string_view channel,
                                       std::span<const std::uint8_t> bytes) override;
  /// Throws BusError with the name of the program where another program has the port.
  void subscribe(std::string_view channel, std::size_t queue_size, Handler handler) override;
  /// Subscribes to the messages of all channels and joins all groups. udpm:// only; throws
  /// BusError.
  void subscribe_all(std::size_t queue_size, Handler handler);
  bool handle_one(int timeout_ms) override;
  std::uint64_t dropped(std::string_view channel) const override;
  /// Messages dropped from the queues of subscribe_all() so far.
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

/// The bus of a live process, with both groups. Throws BusError.
std::unique_ptr<Bus> make_live_bus(const std::string& url);

}  // namespace understory::bus
