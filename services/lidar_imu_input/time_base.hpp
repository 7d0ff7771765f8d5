// Where the sensors' time is: found at the start, and after a pause of all of them.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "services/lidar_imu_input/input_guard.hpp"
#include "services/lidar_imu_input/raw_reading.hpp"

namespace understory::lidar_imu_input {

/// What one reading leads to.
struct BelievedReadings {
  std::vector<RawReading> readings;  ///< To be used now, in order of arrival.
  /// All sensors were silent for so long [s], or this process did not run: time goes on.
  std::optional<double> pause_s;
};

/// Holds readings back whose stamps nothing else supports: the first ones of a drive, and those far
/// ahead of all that came before. Two sensors that agree, or one alone that goes on evenly, are
/// time. Where another sensor goes on at the old time, those that were held are a clock that jumped
/// and are left to `InputGuard`. GNSS proves nothing: receivers start with wrong dates. Invariant:
/// at most 1000 readings are held.
class TimeBase {
 public:
  /// What counts as a jump.
  explicit TimeBase(const FaultParameters& parameters) : parameters_(parameters) {}

  /// Takes a reading; `guard` hears of a pause. `faults` gets those that are left out.
  BelievedReadings take(RawReading reading, InputGuard& guard, std::vector<InputFault>& faults);
  /// All that is held, at the end of the drive.
  std::vector<RawReading> finish();

  /// For saving and loading: what changes while it runs.
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
