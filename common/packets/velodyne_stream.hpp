// Packets of Velodyne lasers (common/io/velodyne.hpp) as every other family's.
#pragma once

#include <optional>

#include "common/io/velodyne.hpp"
#include "common/io/velodyne_fixes.hpp"
#include "common/packets/readings.hpp"

namespace understory::packets {

/// Data and position packets in, revolutions and fixes out. Stamps: the sensor's clock
/// (microseconds past the hour) in the hour nearest to the reception.
class VelodyneStream {
 public:
  /// As VelodyneDecoder.
  explicit VelodyneStream(io::VelodyneCalibration calibration, double max_range_m = 0.0)
      : model_(calibration.model), decoder_(std::move(calibration), max_range_m) {}

  /// What this packet brought: a fix, or the revolution that it ends.
  Readings add(const Packet& packet);
  /// The revolution under way, where it lacks no more than the last packet.
  std::optional<model::PointSweep> finish();

  const StreamCounts& counts() const { return counts_; }  ///< Since the start.

 private:
  io::VelodyneModel model_;
  io::VelodyneDecoder decoder_;
  io::VelodyneFixes fixes_;
  StreamCounts counts_;
};

}  // namespace understory::packets
