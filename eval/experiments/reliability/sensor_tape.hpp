// A simulated drive as messages that wait to be played, with the truth beside them.
#pragma once

#include <cstdint>
#include <vector>

#include "eval/harness/sensor_chain.hpp"
#include "eval/metrics/victoria_park_score.hpp"

namespace understory::eval::experiments::reliability {

/// All raw messages of a drive, in order of the time at which each is complete.
struct SensorTape {
  struct Entry {
    double at_s = 0.0;  ///< Since the beginning of the drive.
    harness::RawMessage message;
  };
  std::vector<Entry> entries;
  std::vector<metrics::StampedPose> truth;  ///< Frame `world`, 50 Hz.

  /// How long the drive lasts [s].
  double seconds() const { return entries.empty() ? 0.0 : entries.back().at_s; }
};

/// A drive through a forest with a VLP-16, an IMU and wheels. Memory: about 3 MB for each second.
SensorTape record_tape(double length_m, std::uint64_t seed);

}  // namespace understory::eval::experiments::reliability
