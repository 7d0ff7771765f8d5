// The EKF stage: the filter, also where scans come late.
#pragma once

#include <optional>
#include <string>

#include "services/ekf/filter.hpp"

namespace understory::ekf {

/// The filter waits for scans, as they come later than the odometry beside them. Where one is
/// overdue (the extractor was busy, hung or restarted, the laser is silent), a copy goes ahead by
/// odometry and gives the poses; when the scan comes, the filter takes it at its own time and the
/// copy is dropped. So a late scan loses nothing: the estimate is that of scans in time. A copy
/// costs about 1 ms where 100 landmarks are in the state; none is made while scans are in time.
class Ekf {
 public:
  /// Throws std::invalid_argument where `error_form` is not one of the three names.
  explicit Ekf(const EkfParameters& parameters) : filter_(parameters) {}

  /// Odometry that has waited for its scan for longer than `max_scan_delay_s` gives a pose without
  /// it. Late, overlapping and broken increments are refused and counted.
  EkfOutput add(const model::Odometry& increment);
  /// Dead reckoning, which gives the motion over an interval of which no odometry came.
  void add(const model::RawPose& pose);
  /// Pose, map and velocity correction at the scan's stamp, `is_late` where a later pose was given
  /// before. Nothing from a scan that is earlier than the one before or by more than kOldestScan_s
  /// than odometry, nor before the map begins (EkfPriorParameters::wait_s).
  EkfOutput add(const model::TrackedScan& scan);
  /// A scan that is later than this beside odometry is not used [s].
  static constexpr double kOldestScan_s = 12.0;

  /// What was used and refused since the object was made.
  EkfCounters counters() const;
  /// The estimate at utime().
  const FilterState& state() const { return newest().state(); }
  /// Stamp of the estimate; 0 before the map begins.
  model::Utime utime() const { return newest().utime(); }

  /// The state as bytes: a filter that loads them goes on with bitwise equal outputs.
  std::string save() const;
  /// Throws std::invalid_argument where the bytes are damaged, of another version or error form, or
  /// hold more landmarks than `max_landmarks`; then nothing has changed.
  void load(const std::string& state);

 private:
  const Filter& newest() const { return ahead_ ? *ahead_ : filter_; }
  void drop_copy();
  void begin_anew();

  Filter filter_;                ///< As of the latest scan.
  std::optional<Filter> ahead_;  ///< As of the latest odometry, while scans are overdue.
  model::Utime given_ = 0;       ///< Stamp of the newest pose that was given.
};

}  // namespace understory::ekf
