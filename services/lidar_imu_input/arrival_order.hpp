// Sorts messages that the network delivered out of order by their stamps.
#pragma once

#include <array>
#include <deque>
#include <optional>

#include "services/lidar_imu_input/input_guard.hpp"
#include "services/lidar_imu_input/raw_reading.hpp"

namespace understory::lidar_imu_input {

/// A sample of IMU, wheels or a one-plane laser waits if an earlier one is missing: of its own
/// sensor, of the other motion sensor, or the preceding sweep; for at most `reorder_s` of the
/// sensors' time. So readings up to that late give bitwise the same result as in time. Samples in
/// order do not wait, except for a sweep under way.
class ArrivalOrder {
 public:
  /// `reorder_s`: the longest wait; 0 = none.
  explicit ArrivalOrder(const FaultParameters& parameters) : parameters_(parameters) {}

  /// Adds a reading. A fault if a reading with the same stamp waits already.
  std::optional<InputFault> add(RawReading reading, const InputGuard& guard);
  /// The next reading to use, if it need not wait (or `everything`). Use each before the next call:
  /// `guard` keeps the last one used.
  std::optional<RawReading> next(const InputGuard& guard, bool everything);

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.waiting_, self.newest_, self.sequences_);
    for (auto& laser : self.lasers_) a(laser.end, laser.late_us);
  }

 private:
  /// The latest reading of a laser.
  struct Laser {
    std::optional<model::Utime> end;
    model::Utime late_us = 0;  ///< Delay behind the other sensors at its arrival.
  };
  bool may_go(const RawReading& reading, const InputGuard& guard) const;
  bool is_next(const RawReading& reading, model::Utime last, const InputGuard& guard) const;
  bool misses_motion(Sensor sensor, model::Utime utime, const InputGuard& guard) const;
  bool misses_laser(Sensor laser, const InputGuard& guard) const;

  FaultParameters parameters_;
  std::deque<RawReading> ready_;  ///< Of sensors that do not wait, except at the start; not saved.
  std::deque<HeldReading> waiting_;     ///< In order of their stamps.
  std::optional<model::Utime> newest_;  ///< Of all sensors, including waiting readings.
  std::array<std::uint64_t, kSensors> sequences_{};  ///< Of the latest one used.
  std::array<Laser, kSensors> lasers_;               ///< Of kSweep and kScan.
};

}  // namespace understory::lidar_imu_input
