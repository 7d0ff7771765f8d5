// The EKF stage: the filter, extended for late scans.
#pragma once

#include <optional>
#include <string>

#include "services/ekf/filter.hpp"

namespace understory::ekf {

/// Scans arrive later than the odometry of the same time, so the filter waits for them. If one is
/// overdue (the extractor is busy, hangs or restarted, the laser is silent), a copy of the filter
/// continues with odometry and gives the poses; when the scan arrives, the filter uses it at its
/// own time and the copy is dropped. So a late scan loses nothing: the estimate is the same as with
/// scans in time. A copy costs about 1 ms with 100 landmarks in the state; none is made while scans
/// are in time.
class Ekf {
 public:
  /// Throws std::invalid_argument if `error_form` is not one of the three names.
  explicit Ekf(const EkfParameters& parameters) : filter_(parameters) {}

  /// Adds odometry. If it has waited for its scan for longer than `max_scan_delay_s`, it gives a
  /// pose without the scan. Late, overlapping and invalid increments are refused and counted.
  EkfOutput add(const model::Odometry& increment);
  /// Adds a pose of dead reckoning: the motion over an interval without odometry.
  void add(const model::RawPose& pose);
  /// Pose, map and velocity correction at the scan's stamp, `is_late` if a later pose was given
  /// before. None for a scan that is earlier than the previous one, or than odometry by more than
  /// kOldestScan_s, nor before the map begins (EkfPriorParameters::wait_s).
  EkfOutput add(const model::TrackedScan& scan);
  /// Largest delay of a scan relative to odometry; a later one is not used [s].
  static constexpr double kOldestScan_s = 12.0;

  /// Counts since the object was made.
  EkfCounters counters() const;
  /// The estimate at utime().
  const FilterState& state() const { return newest().state(); }
  /// Stamp of the estimate; 0 before the map begins.
  model::Utime utime() const { return newest().utime(); }

  /// The state as bytes: a filter that loads them continues with bitwise equal outputs.
  std::string save() const;
  /// Throws std::invalid_argument, without change, if the bytes are damaged, of another version or
  /// error form, or hold more landmarks than `max_landmarks`.
  void load(const std::string& state);

 private:
  const Filter& newest() const { return ahead_ ? *ahead_ : filter_; }
  void drop_copy();
  void begin_anew();

  Filter filter_;                ///< At the latest scan.
  std::optional<Filter> ahead_;  ///< At the latest odometry, while scans are overdue.
  model::Utime given_ = 0;       ///< Stamp of the newest pose given out.
};

}  // namespace understory::ekf
