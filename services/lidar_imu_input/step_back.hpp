// A large step back of all clocks: another recording is played.
#pragma once

#include <optional>
#include <vector>

#include "services/lidar_imu_input/input_guard.hpp"
#include "services/lidar_imu_input/raw_reading.hpp"

namespace understory::lidar_imu_input {

/// Result of one reading.
struct AfterStepBack {
  std::vector<RawReading> readings;  ///< To be used now, in order of arrival.
  std::optional<double> back_s;      ///< Step back of all clocks [s].
};

/// Holds readings back that are far behind all others. If they span a second, contain every live
/// sensor, and none continues at the old time, the vehicle's pose is unknown: an offset is added to
/// the stamps, so that time continues after a gap. Else they are passed to `InputGuard`: the clock
/// of one sensor jumped, or a sensor's messages arrive late in one burst. GNSS is no evidence.
class StepBack {
 public:
  /// Adds a raw reading; the result is in the time that never goes back.
  AfterStepBack take(RawReading reading, const InputGuard& guard);
  /// All held readings, at the end of the drive.
  std::vector<RawReading> finish();

  /// Members of a saved state; see common/state. The rest is configuration. Held readings are lost.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.moved_us_);
  }

 private:
  bool has_all_live(const InputGuard& guard) const;

  model::Utime moved_us_ = 0;  ///< Added to every stamp.
  std::vector<RawReading> held_;
};

}  // namespace understory::lidar_imu_input
