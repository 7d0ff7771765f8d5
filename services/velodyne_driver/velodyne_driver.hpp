// The Velodyne driver's stage: packets in, sweeps, fixes and packet faults out.
//
// Stamps: a sweep's utime is that of its first point, point times count from it. With time source
// "sensor" it is the sensor's own clock (microseconds past the hour), in the hour that is nearest
// to the reception of the first packet, as in the import of captures: correct if PPS and NMEA set
// the sensor's clock. With "received" the offset between the clocks, from the least delayed
// packets, is added: for a sensor without GNSS; late by the delay of a packet (some tenths of a
// millisecond). Fixes have the reception time of their packet.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/io/velodyne.hpp"
#include "common/io/velodyne_fixes.hpp"
#include "common/model/gnss.hpp"
#include "common/model/point_sweep.hpp"
#include "common/wire/result.hpp"
#include "services/lidar_driver/driver_output.hpp"
#include "services/velodyne_driver/parameters.hpp"
#include "services/velodyne_driver/velodyne_clock.hpp"

namespace understory::velodyne_driver {

/// Packet counts since the start.
struct VelodyneDriverCounts {
  std::uint64_t data_packets = 0;  ///< All received at the data port.
  std::uint64_t wrong_size = 0;
  std::uint64_t wrong_model = 0;       ///< Of a sensor of another model.
  std::uint64_t damaged = 0;           ///< Impossible flags or azimuths.
  std::uint64_t late = 0;              ///< Out of order by less than 20 ms.
  std::uint64_t gaps = 0;              ///< Gaps in time: the sweep in progress was discarded.
  std::uint64_t jumps = 0;             ///< Jumps of the sensor's clock: likewise.
  std::uint64_t holes = 0;             ///< Sweeps with missing packets.
  std::uint64_t sweeps = 0;            ///< Published.
  std::uint64_t position_packets = 0;  ///< All received at the position port.
  std::uint64_t bad_positions = 0;     ///< No NMEA sentence, or a wrong checksum.
  std::uint64_t fixes = 0;             ///< Published.

  /// Number of data packets that were not used.
  std::uint64_t refused() const { return wrong_size + wrong_model + damaged + late; }
};

/// Decodes packets, assembles sweeps and stamps them. No state survives a restart: a sweep in
/// progress is lost, as when a real sensor was off.
class VelodyneDriver {
 public:
  /// `calibration`: of the model in `parameters.sensor`.
  VelodyneDriver(const VelodyneDriverParameters& parameters, io::VelodyneCalibration calibration);

  /// Adds a packet of the data port (0) or of the position port (1).
  lidar_driver::DriverOutput add(std::size_t port, std::span<const std::uint8_t> packet,
                                 std::size_t size, model::Utime received) {
    return port == 0 ? add_data(packet, size, received) : add_position(packet, size, received);
  }
  /// Adds a data packet. `size`: of the packet as sent, if `packet` holds only its beginning.
  /// `received`: by the computer's clock [us].
  lidar_driver::DriverOutput add_data(std::span<const std::uint8_t> packet, std::size_t size,
                                      model::Utime received);
  /// Adds a position packet; parameters as above.
  lidar_driver::DriverOutput add_position(std::span<const std::uint8_t> packet, std::size_t size,
                                          model::Utime received);
  /// The sweep in progress, if it is almost complete.
  std::optional<model::PointSweep> finish();

  const VelodyneDriverCounts& counts() const { return counts_; }  ///< Since the start.
  /// The counts, for LOG.
  std::string summary(const lidar_driver::SocketCounts& sockets) const;
  /// What is wrong with the sensor's clock now, if anything is.
  std::optional<wire::Refusal> clock_fault() const;

 private:
  bool refuse(std::span<const std::uint8_t> packet, std::size_t size,
              std::vector<wire::Refusal>& faults);
  /// Discards the sweep in progress: the next packet does not continue it.
  void start_over();
  std::optional<model::PointSweep> stamped(std::optional<model::PointSweep> sweep);

  VelodyneDriverParameters parameters_;
  io::VelodyneCalibration calibration_;
  io::VelodyneDecoder decoder_;
  VelodyneClock clock_;
  io::VelodyneFixes fixes_;
  VelodyneDriverCounts counts_;
  std::uint64_t next_revolution_ = 0;  ///< The number of the decoder's revolution 0.
  std::uint64_t holes_reported_ = 0;   ///< Of the decoder's count.
};

}  // namespace understory::velodyne_driver
