// Two groups as one bus: sweeps travel apart from everything else, so that only who wants them gets
// their packets.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/bus/bus.hpp"

namespace understory::bus {

/// Whether a channel carries bulk: RAW_SWEEP and LIDAR_SWEEP, with any suffix.
bool is_bulk_channel(std::string_view channel);

/// The group beside `lcm_url`: address and port one higher; a URL that is not udpm:// stays.
std::string bulk_lcm_url(const std::string& lcm_url);

/// Bulk channels go to the second bus, which is joined when the first of them is used. Between the
/// two, messages have no order. `dropped` and the receive buffer are those of the bus in question.
class SplitBus : public Bus {
 public:
  /// Joins the bulk group when it is first needed.
  using MakeBus = std::function<std::unique_ptr<Bus>()>;
  /// `main` must not be null; `make_bulk` is called once at most.
  SplitBus(std::unique_ptr<Bus> main, MakeBus make_bulk);
  ~SplitBus() override;

  std::optional<wire::Refusal> publish(std::string_view channel,
                                       std::span<const std::uint8_t> bytes) override;
  void subscribe(std::string_view channel, std::size_t queue_size, Handler handler) override;
  bool handle_one(int timeout_ms) override;
  std::uint64_t dropped(std::string_view channel) const override;
  int file_descriptor() const override { return epoll_; }
  ReceiveBuffer receive_buffer() const override { return main_->receive_buffer(); }
  DatagramFaults refused_datagrams() const override;

 private:
  Bus& bulk();
  Bus& bus_of(std::string_view channel);

  std::unique_ptr<Bus> main_;
  MakeBus make_bulk_;
  std::unique_ptr<Bus> bulk_;
  int epoll_ = -1;
  bool bulk_slot_ = false;  ///< Which one is asked first: a flood on one must not starve the other.
};

/// Both groups of a live system: LiveBus for `url` and for the bulk beside it, the latter paced at
/// `bulk_bytes_per_s` so that a burst fits into the receivers' socket buffers. Throws BusError.
std::unique_ptr<Bus> make_live_bus(const std::string& url, double bulk_bytes_per_s = 60e6);

}  // namespace understory::bus
