// The UDP ports of a laser, and the queue of sweeps to publish.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "common/bus/node.hpp"
#include "common/model/point_sweep.hpp"
#include "common/wire/result.hpp"
#include "services/lidar_driver/driver_output.hpp"
#include "services/lidar_driver/parameters.hpp"
#include "services/lidar_driver/udp_socket.hpp"

namespace understory::lidar_driver {

/// The sockets of a sensor's ports, and the reporting of their faults.
class PacketSockets {
 public:
  /// Throws std::runtime_error if a port is in use.
  PacketSockets(const NetworkParameters& network, const std::vector<PortSettings>& ports);

  std::size_t size() const { return sockets_.size(); }                 ///< Number of ports.
  UdpSocket& operator[](std::size_t port) { return *sockets_[port]; }  ///< In the given order.
  const UdpSocket& operator[](std::size_t port) const { return *sockets_[port]; }
  /// For poll().
  std::vector<int> file_descriptors() const;
  /// Number of packets that the kernel dropped.
  std::uint64_t overruns() const;
  /// Overruns and network errors since the last call.
  std::vector<wire::Refusal> new_faults();

 private:
  std::vector<std::unique_ptr<UdpSocket>> sockets_;
  std::uint64_t overruns_reported_ = 0;
  std::uint64_t errors_reported_ = 0;
};

/// Parts of sweeps that wait to be published. Publishing is paced: parts are sent one at a time,
/// and the sockets are read in between.
class SweepOutbox {
 public:
  /// Without a channel: post() must not be called.
  SweepOutbox() = default;
  /// Publishes on `sweeps`.
  explicit SweepOutbox(bus::Publisher<model::PointSweep> sweeps) : sweeps_(sweeps) {}

  /// False: too many parts wait, and the sweep is discarded.
  bool post(const model::PointSweep& sweep);
  /// Publishes one part, if there is any.
  void send_part();
  /// Whether no part waits.
  bool empty() const { return parts_.empty(); }

 private:
  bus::Publisher<model::PointSweep> sweeps_;
  std::deque<model::PointSweep> parts_;
};

}  // namespace understory::lidar_driver
