// The filter's time: start of its map, and order of stamps.
#pragma once

#include <optional>

#include "common/model/odometry.hpp"

namespace understory::ekf {

/// Tolerance of stamps of one instant, for rounding [us].
inline constexpr model::Utime kTolerance_us = 1000;

/// Seconds of a duration in microseconds.
double seconds(model::Utime duration_us);
/// Microseconds of a duration in seconds, rounded towards zero.
model::Utime microseconds(double duration_s);

/// Order of a stamp relative to earlier ones.
enum class StampOrder { kInOrder, kLate, kClockJumpedBack };

/// Relation of an odometry increment to the filter's time.
enum class Interval {
  kFollows,   ///< It begins at the filter's time.
  kAfterGap,  ///< It begins later.
  kOverlaps,  ///< It begins earlier and ends later.
  kPast,      ///< It ends by the filter's time.
};

/// Owner of the filter's time. Before the map begins there is none: until an IMU is found to be
/// stationary, which takes half a second, the vehicle's speed and the gyro's bias are unknown, and
/// the map's origin would keep their error.
class Timeline {
 public:
  /// `wait_s`: longest wait for the start. `clock_jump_s`: a scan earlier by more than this shows
  /// that the clock jumped back.
  Timeline(double wait_s, double clock_jump_s);

  /// True once the map has begun.
  bool has_begun() const { return has_begun_; }
  /// True after the first odometry, before the map begins.
  bool is_waiting() const { return first_odometry_.has_value(); }
  /// Whether the map may begin with `increment`: without an IMU, stationary, moving by its wheels,
  /// or after the longest wait.
  bool may_begin(const model::Odometry& increment);
  /// Begins the map at `utime`.
  void begin(model::Utime utime);

  /// Stamp of the estimate; 0 before the map begins.
  model::Utime now() const { return now_; }
  /// Sets the stamp of the estimate.
  void move_to(model::Utime utime) { now_ = utime; }
  /// Whether `utime` is later than now() by more than the tolerance.
  bool is_behind(model::Utime utime) const { return utime > now_ + kTolerance_us; }
  /// Relation of `increment` to now().
  Interval interval_of(const model::Odometry& increment) const;

  /// Order of a scan at `utime` relative to the previous scan and the filter's time.
  StampOrder order_of_scan(model::Utime utime) const;
  /// Sets the stamp of the latest scan.
  void set_last_scan(model::Utime utime) { last_scan_ = utime; }
  /// From now on any scan at now() or later is in order.
  void forget_scans() { last_scan_.reset(); }

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.has_begun_, self.first_odometry_, self.now_, self.last_scan_);
  }

 private:
  model::Utime wait_us_;
  model::Utime clock_jump_us_;
  bool has_begun_ = false;
  std::optional<model::Utime>
      first_odometry_;  ///< Start of the first odometry, before the map begins.
  model::Utime now_ = 0;
  std::optional<model::Utime> last_scan_;
};

}  // namespace understory::ekf
