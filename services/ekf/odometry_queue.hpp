// Odometry that waits for the scan at its end.
#pragma once

#include <deque>
#include <optional>

#include "common/model/archive.hpp"
#include "common/model/odometry.hpp"
#include "services/ekf/timeline.hpp"

namespace understory::ekf {

/// True if the interval is positive, all numbers are finite and no variance is negative.
bool is_usable(const model::Odometry& increment);

/// Increments in order of time. A scan arrives later than the odometry after it, so odometry is
/// used when its scan has arrived; it is overdue after a wait of `max_delay_s`.
class OdometryQueue {
 public:
  /// `max_delay_s`: longest wait for a scan. `clock_jump_s`: a stamp earlier by more than this
  /// shows that the clock jumped back.
  OdometryQueue(double max_delay_s, double clock_jump_s);

  /// Order of `increment` relative to the increments received before it; `now`: the filter's time.
  StampOrder order_of(const model::Odometry& increment, model::Utime now) const;
  /// Adds the latest increment. Precondition: order_of() returns kInOrder for it, or the queue is
  /// empty.
  void push(const model::Odometry& increment);
  /// Removes and returns the oldest increment if it ends by `utime` (tolerance 1 ms).
  std::optional<model::Odometry> take_ended_by(model::Utime utime);
  /// The newest increment. Precondition: an increment waits.
  const model::Odometry& newest() const { return increments_.back(); }
  /// Removes all increments.
  void clear() { increments_.clear(); }

  /// Stamp up to which increments are overdue; none if the oldest is not.
  std::optional<model::Utime> overdue() const;
  /// From the beginning of the oldest increment to the end of the newest [s].
  double waiting_s() const {
    if (increments_.empty()) return 0.0;
    return seconds(increments_.back().utime - increments_.front().from_utime);
  }
  /// The oldest waiting increment; null if none waits.
  const model::Odometry* next() const {
    return increments_.empty() ? nullptr : &increments_.front();
  }

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.increments_);
  }

 private:
  model::Utime max_delay_us_;
  model::Utime clock_jump_us_;
  std::deque<model::Odometry> increments_;
};

}  // namespace understory::ekf
