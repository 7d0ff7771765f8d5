// Packets of Velodyne lasers (common/io/velodyne.hpp) with the interface of all families.
#pragma once

#include <optional>

#include "common/io/velodyne.hpp"
#include "common/io/velodyne_fixes.hpp"
#include "common/packets/readings.hpp"

namespace understory::packets {

/// Input: data and position packets; output: revolutions and fixes. Stamps: the sensor's clock
/// (microseconds past the hour) in the hour nearest to the reception.
class VelodyneStream {
 public:
  /// Parameters as for VelodyneDecoder.
  explicit VelodyneStream(io::VelodyneCalibration calibration, double max_range_m = 0.0)
      : model_(calibration.model), decoder_(std::move(calibration), max_range_m) {}

  /// Adds a packet; returns a fix, or the revolution that it ends.
  Readings add(const Packet& packet);
  /// The present revolution, if at most its last packet is missing.
  std::optional<model::PointSweep> finish();

  const StreamCounts& counts() const { return counts_; }  ///< Counts since the start.

 private:
  io::VelodyneModel model_;
  io::VelodyneDecoder decoder_;
  io::VelodyneFixes fixes_;
  StreamCounts counts_;
};

}  // namespace understory::packets
