// Sweeps and scans that wait for their motion.
#pragma once

#include <deque>
#include <optional>
#include <variant>

#include "common/model/planar_scan.hpp"
#include "common/model/point_sweep.hpp"
#include "services/lidar_imu_input/input_fault.hpp"

namespace understory::lidar_imu_input {

/// A sweep whose points were lost at a restart: an increment of odometry still ends at its stamp.
struct LostSweep {};

/// One item of the queue.
struct WaitingSweep {
  model::Utime end = 0;  ///< Time of its last point.
  std::variant<LostSweep, model::PointSweep, model::PlanarScan> item;

  /// Points of sweeps are bulk data: a sweep is saved as a lost one.
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

/// Result of adding an item to the queue.
struct Admission {
  bool is_carried = false;          ///< It is late: its stamp is the end of the latest increment.
  bool dropped_oldest = false;      ///< The queue was full.
  std::optional<InputFault> fault;  ///< It is too late and was dropped.
};

/// Invariant: items are in order of their ends; at most 20 wait; released stamps advance.
class SweepQueue {
 public:
  /// Adds an item in order. `increment_end`: end of the latest odometry. A published increment is
  /// not changed: an item to be de-skewed that ends before it is moved to its end, by at most
  /// 0.25 s; a scan taken in one instant is dropped.
  Admission add(WaitingSweep waiting, std::optional<model::Utime> increment_end);

  /// Whether nothing waits.
  bool empty() const { return waiting_.empty(); }
  /// Precondition: not empty.
  const WaitingSweep& front() const { return waiting_.front(); }
  /// Removes and returns the first item. Precondition: not empty.
  WaitingSweep take();
  /// Whether an item may be published: it has its points and a new stamp. If so the stamp counts as
  /// released.
  bool release(const WaitingSweep& waiting);

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.waiting_, self.sweep_stamp_, self.scan_stamp_);
  }

 private:
  std::deque<WaitingSweep> waiting_;
  std::optional<model::Utime> sweep_stamp_;  ///< Of the latest released sweep.
  std::optional<model::Utime> scan_stamp_;   ///< The same of scans.
};

}  // namespace understory::lidar_imu_input
