// The two ports that a Velodyne sends to, and sweeps on their way to the bus.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "common/bus/node.hpp"
#include "common/model/point_sweep.hpp"
#include "common/wire/result.hpp"
#include "services/velodyne_driver/parameters.hpp"
#include "services/velodyne_driver/udp_socket.hpp"

namespace understory::velodyne_driver {

/// The sockets for data and position packets, and which of their faults have been reported.
class PacketSockets {
 public:
  /// Throws std::runtime_error where a port is taken.
  explicit PacketSockets(const VelodyneNetworkParameters& network)
      : data_(network.bind_address, network.data_port, network.receive_buffer_bytes),
        positions_(network.bind_address, network.position_port, network.receive_buffer_bytes) {}

  UdpSocket& data() { return data_; }            ///< Data packets: points.
  UdpSocket& positions() { return positions_; }  ///< Position packets: GNSS.
  /// To be polled.
  std::vector<int> file_descriptors() const {
    return {data_.file_descriptor(), positions_.file_descriptor()};
  }
  /// Packets that the kernel threw away so far.
  std::uint64_t overruns() const { return data_.overruns() + positions_.overruns(); }
  /// Overruns and network errors since the last call.
  std::vector<wire::Refusal> new_faults();

 private:
  UdpSocket data_;
  UdpSocket positions_;
  std::uint64_t overruns_reported_ = 0;
  std::uint64_t errors_reported_ = 0;
};

/// Parts of sweeps that wait to be published. Publishing is paced, so parts go out one at a time
/// and the sockets are emptied in between.
class SweepOutbox {
 public:
  /// Without a channel: nothing must be posted.
  SweepOutbox() = default;
  /// Publishes on `sweeps`.
  explicit SweepOutbox(bus::Publisher<model::PointSweep> sweeps) : sweeps_(std::move(sweeps)) {}

  /// False: too many parts wait, and the sweep is left out.
  bool post(const model::PointSweep& sweep);
  /// Publishes one part, if there is any.
  void send_part();
  /// Whether no part waits.
  bool empty() const { return parts_.empty(); }

 private:
  bus::Publisher<model::PointSweep> sweeps_;
  std::deque<model::PointSweep> parts_;
};

}  // namespace understory::velodyne_driver
