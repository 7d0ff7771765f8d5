// The Velodyne driver's stage: packets in, turns and fixes out, and what is wrong with the packets.
//
// Stamps: a turn's utime is that of its first point, point times count from it. With time source
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
#include "services/velodyne_driver/parameters.hpp"
#include "services/velodyne_driver/velodyne_clock.hpp"

namespace understory::velodyne_driver {

struct VelodyneDriverCounts {
  std::uint64_t data_packets = 0;  ///< All that came to the data port.
  std::uint64_t wrong_size = 0;
  std::uint64_t wrong_model = 0;
  std::uint64_t damaged = 0;
  std::uint64_t late = 0;  ///< Out of order by little.
  std::uint64_t gaps = 0;  ///< In time: the turn under way was given up.
  std::uint64_t jumps = 0;
  std::uint64_t holes = 0;  ///< Turns from which packets are missing.
  std::uint64_t turns = 0;
  std::uint64_t position_packets = 0;
  std::uint64_t bad_positions = 0;
  std::uint64_t fixes = 0;

  std::uint64_t refused() const { return wrong_size + wrong_model + damaged + late; }
};

struct VelodyneDriverOutput {
  std::optional<model::PointSweep> turn;
  std::optional<model::GnssFix> fix;
  std::vector<wire::Refusal> faults;
};

class VelodyneDriver {
 public:
  VelodyneDriver(const VelodyneDriverParameters& parameters, io::VelodyneCalibration calibration);

  /// `size`: of the packet as sent, where `packet` holds only its begin. `received`: when it came,
  /// by the computer's clock.
  VelodyneDriverOutput add_data(std::span<const std::uint8_t> packet, std::size_t size,
                                model::Utime received);
  VelodyneDriverOutput add_position(std::span<const std::uint8_t> packet, std::size_t size,
                                    model::Utime received);
  /// The turn under way, where it is as good as whole.
  std::optional<model::PointSweep> finish();

  const VelodyneDriverCounts& counts() const { return counts_; }
  /// How far the computer's clock is ahead of the sensor's [us].
  std::optional<model::Utime> clock_offset_us() const { return clock_.offset_us(); }
  /// What is wrong with the sensor's clock as it stands, if anything is.
  std::optional<wire::Refusal> clock_fault() const;

 private:
  bool refuse(std::span<const std::uint8_t> packet, std::size_t size,
              std::vector<wire::Refusal>& faults);
  /// Gives up the turn under way: what comes is not its continuation.
  void start_over();
  std::optional<model::PointSweep> stamped(std::optional<model::PointSweep> turn);

  VelodyneDriverParameters parameters_;
  io::VelodyneCalibration calibration_;
  io::VelodyneDecoder decoder_;
  VelodyneClock clock_;
  io::VelodyneFixes fixes_;
  VelodyneDriverCounts counts_;
  std::uint64_t next_revolution_ = 0;  ///< The number that the decoder's turn 0 has.
  std::uint64_t holes_had_ = 0;        ///< Of the decoder's count.
};

}  // namespace understory::velodyne_driver
