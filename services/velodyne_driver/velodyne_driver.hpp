// The Velodyne driver's stage: packets in, sweeps and fixes out, and what is wrong with the
// packets.
//
// Stamps: a sweep's utime is that of its first point, point times count from it. With time source
// "sensor" it is the sensor's own clock (microseconds past the hour) in the hour that was nearest
// when the first packet came, as the import of captures has it: right where the sensor is set by
// PPS and NMEA. With "received" the offset between the clocks, by the packets that were least
// delayed, is added: for a sensor without GNSS; late by the time that a packet needs (some tenths
// of a millisecond). Fixes have the time at which their packet came.
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

/// What became of the packets since the start.
struct VelodyneDriverCounts {
  std::uint64_t data_packets = 0;  ///< All that came to the data port.
  std::uint64_t wrong_size = 0;
  std::uint64_t wrong_model = 0;       ///< Of a sensor of another model.
  std::uint64_t damaged = 0;           ///< Impossible flags or azimuths.
  std::uint64_t late = 0;              ///< Out of order by less than 20 ms.
  std::uint64_t gaps = 0;              ///< In time: the sweep in progress was left out.
  std::uint64_t jumps = 0;             ///< Of the sensor's clock: the same.
  std::uint64_t holes = 0;             ///< Sweeps from which packets are missing.
  std::uint64_t sweeps = 0;            ///< Given out.
  std::uint64_t position_packets = 0;  ///< All that came to the position port.
  std::uint64_t bad_positions = 0;     ///< No sentence, or a wrong checksum.
  std::uint64_t fixes = 0;             ///< Given out.

  /// Data packets that were not used.
  std::uint64_t refused() const { return wrong_size + wrong_model + damaged + late; }
};

/// Decodes packets, assembles them to sweeps and stamps these. No state outlives a restart: a sweep
/// that is in progress is lost, as on a real sensor that was off.
class VelodyneDriver {
 public:
  /// `calibration`: of the model in `parameters.sensor`.
  VelodyneDriver(const VelodyneDriverParameters& parameters, io::VelodyneCalibration calibration);

  /// Takes a packet of the data port (0) or of the position port (1).
  lidar_driver::DriverOutput add(std::size_t port, std::span<const std::uint8_t> packet,
                                 std::size_t size, model::Utime received) {
    return port == 0 ? add_data(packet, size, received) : add_position(packet, size, received);
  }
  /// Takes a data packet. `size`: of the packet as sent, where `packet` holds only its begin.
  /// `received`: by the computer's clock [us].
  lidar_driver::DriverOutput add_data(std::span<const std::uint8_t> packet, std::size_t size,
                                      model::Utime received);
  /// Takes a position packet; parameters as above.
  lidar_driver::DriverOutput add_position(std::span<const std::uint8_t> packet, std::size_t size,
                                          model::Utime received);
  /// The sweep in progress, where it is almost whole.
  std::optional<model::PointSweep> finish();

  const VelodyneDriverCounts& counts() const { return counts_; }  ///< Since the start.
  /// The counts, for LOG.
  std::string summary(const lidar_driver::SocketCounts& sockets) const;
  /// How far the computer's clock is ahead of the sensor's [us].
  std::optional<model::Utime> clock_offset_us() const { return clock_.offset_us(); }
  /// What is wrong with the sensor's clock now, if anything is.
  std::optional<wire::Refusal> clock_fault() const;

 private:
  bool refuse(std::span<const std::uint8_t> packet, std::size_t size,
              std::vector<wire::Refusal>& faults);
  /// Leaves out the sweep in progress: what comes is not its continuation.
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
