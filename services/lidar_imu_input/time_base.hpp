// Determines the sensors' time at the start, and after a pause of all of them.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "services/lidar_imu_input/input_guard.hpp"
#include "services/lidar_imu_input/raw_reading.hpp"

namespace understory::lidar_imu_input {

/// Result of one reading.
struct BelievedReadings {
  std::vector<RawReading> readings;  ///< To be used now, in order of arrival.
  /// Silence of all sensors, or time during which this process did not run [s]: time continues.
  std::optional<double> pause_s;
};

/// Holds readings back whose stamps have no support: the first ones of a drive, and those far ahead
/// of all earlier ones. Two sensors that agree, or a single one with evenly spaced stamps,
/// determine the time. If another sensor continues at the old time, the held readings are of a
/// clock that jumped, and are passed to `InputGuard`. GNSS is no evidence: receivers start with
/// wrong dates. Invariant: at most 1000 readings are held.
class TimeBase {
 public:
  /// `parameters`: size of a jump.
  explicit TimeBase(const FaultParameters& parameters) : parameters_(parameters) {}

  /// Adds a reading; reports a pause to `guard`. `faults` gets the dropped readings.
  BelievedReadings take(RawReading reading, InputGuard& guard, std::vector<InputFault>& faults);
  /// All held readings, at the end of the drive.
  std::vector<RawReading> finish();

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.held_);
    if constexpr (Archive::kReads) self.drop_lost();
  }

 private:
  bool is_ahead(const RawReading& reading, const InputGuard& guard) const;
  bool is_proven(const InputGuard& guard) const;
  int evenly_before_newest(const InputGuard& guard, double longest_step_s) const;
  BelievedReadings go_on(InputGuard& guard, std::vector<InputFault>& faults);
  void drop_lost();

  FaultParameters parameters_;
  std::deque<HeldReading> held_;
};

}  // namespace understory::lidar_imu_input
