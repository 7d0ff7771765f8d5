// Sweeps and scans that wait until the motion of their time is known.
#pragma once

#include <deque>
#include <optional>
#include <variant>

#include "common/model/planar_scan.hpp"
#include "common/model/point_sweep.hpp"
#include "services/lidar_imu_input/input_fault.hpp"

namespace understory::lidar_imu_input {

/// A sweep whose points were lost at a restart: its increment of odometry still ends there.
struct LostSweep {};

/// One item of the queue.
struct WaitingSweep {
  model::Utime end = 0;  ///< When its last point was measured.
  std::variant<LostSweep, model::PointSweep, model::PlanarScan> item;

  /// Points of sweeps are bulk and no state: a sweep is saved as a lost one.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    std::optional<model::PlanarScan> scan;
    if (const auto* waiting = std::get_if<model::PlanarScan>(&self.item)) scan = *waiting;
    a(self.end, scan);
    if constexpr (Archive::kReads) {
      if (scan) self.item = *std::move(scan);
    }
  }
};

/// What became of an item that was put into the queue.
struct Admission {
  bool is_carried = false;          ///< It came late: its stamp is the end of the latest increment.
  bool dropped_oldest = false;      ///< The queue was full.
  std::optional<InputFault> fault;  ///< It came too late and was dropped.
};

/// Invariant: items are in order of their ends; at most 20 wait; stamps that were released advance.
class SweepQueue {
 public:
  /// Puts an item in its place. `increment_end`: where the latest odometry ended. An increment that
  /// was published is not taken back: what is to be de-skewed and ends before it is carried to it,
  /// by at most 0.25 s; a scan taken at once is dropped.
  Admission add(WaitingSweep waiting, std::optional<model::Utime> increment_end);

  /// Whether nothing waits.
  bool empty() const { return waiting_.empty(); }
  /// Precondition: not empty.
  const WaitingSweep& front() const { return waiting_.front(); }
  /// Takes the first item out. Precondition: not empty.
  WaitingSweep take();
  /// Whether an item may be published: its points are there, and its stamp is new. If so the stamp
  /// counts as released.
  bool release(const WaitingSweep& waiting);

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.waiting_, self.sweep_stamp_, self.scan_stamp_);
  }

 private:
  std::deque<WaitingSweep> waiting_;
  std::optional<model::Utime> sweep_stamp_;  ///< Of the latest sweep that was released.
  std::optional<model::Utime> scan_stamp_;   ///< The same of scans.
};

}  // namespace understory::lidar_imu_input
