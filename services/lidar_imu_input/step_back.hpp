// All clocks go far back at once: another recording is played.
#pragma once

#include <optional>
#include <vector>

#include "services/lidar_imu_input/input_guard.hpp"
#include "services/lidar_imu_input/raw_reading.hpp"

namespace understory::lidar_imu_input {

/// What one reading leads to.
struct AfterStepBack {
  std::vector<RawReading> readings;  ///< To be taken now, in order of arrival.
  std::optional<double> back_s;      ///< All clocks have gone back by so much [s].
};

/// Holds readings back that are far behind all others. Where a second goes by in them, every live
/// sensor is among them, and none goes on at the old time, nobody knows where the vehicle is now:
/// stamps are moved so that time goes on behind a gap. Else they are left to `InputGuard`: the
/// clock of one sensor that jumped, or a sensor whose messages come late in one burst. GNSS proves
/// nothing.
class StepBack {
 public:
  /// Takes a reading as it came; what it gives is on the time that never goes back.
  AfterStepBack take(RawReading reading, const InputGuard& guard);
  /// All that is held, at the end of the drive.
  std::vector<RawReading> finish();

  /// For saving and loading: what changes while it runs. Readings that are held are lost.
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
