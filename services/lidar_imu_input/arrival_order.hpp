// Messages that the network brought out of order, in the order of their stamps again.
#pragma once

#include <array>
#include <deque>
#include <optional>

#include "services/lidar_imu_input/input_guard.hpp"
#include "services/lidar_imu_input/raw_reading.hpp"

namespace understory::lidar_imu_input {

/// Samples of IMU, wheels and one-plane lasers wait where one before them is missing, of their own
/// sensor, of the other one that measures motion, or the sweep that they follow; for `reorder_s` of
/// the sensors' time at most. So readings that come up to that late are used as if they had come in
/// time, to the bit. Samples that come in order do not wait, but for a sweep that is on its way.
class ArrivalOrder {
 public:
  /// `reorder_s`: the longest wait; 0 = none.
  explicit ArrivalOrder(const FaultParameters& parameters) : parameters_(parameters) {}

  /// Takes a reading. A fault where its stamp is one that waits already.
  std::optional<InputFault> add(RawReading reading, const InputGuard& guard);
  /// The next one to be used, if there is one (or `everything`). Each is to be used before the next
  /// is asked for: `guard` knows what came last.
  std::optional<RawReading> next(const InputGuard& guard, bool everything);

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.waiting_, self.newest_, self.sequences_);
    for (auto& laser : self.lasers_) a(laser.end, laser.late_us);
  }

 private:
  /// The latest reading of a laser.
  struct Laser {
    std::optional<model::Utime> end;
    model::Utime late_us = 0;  ///< How far the others were then.
  };
  bool may_go(const RawReading& reading, const InputGuard& guard) const;
  bool is_next(const RawReading& reading, model::Utime last, const InputGuard& guard) const;
  bool misses_motion(Sensor sensor, model::Utime utime, const InputGuard& guard) const;
  bool misses_laser(Sensor laser, const InputGuard& guard) const;

  FaultParameters parameters_;
  std::deque<RawReading> ready_;     ///< Of sensors that do not wait, but at the start; not saved.
  std::deque<HeldReading> waiting_;  ///< In the order of their stamps.
  std::optional<model::Utime> newest_;               ///< Of all sensors, waiting ones too.
  std::array<std::uint64_t, kSensors> sequences_{};  ///< Of the latest one used.
  std::array<Laser, kSensors> lasers_;               ///< Of kSweep and kScan.
};

}  // namespace understory::lidar_imu_input
