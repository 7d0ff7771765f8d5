// EKF-SLAM in the plane on odometry and tracked landmarks (vehicle stack, section 3.2.3 "EKF
// Node").
#pragma once

#include <string>
#include <vector>

#include "common/model/ekf_output.hpp"
#include "common/model/odometry.hpp"
#include "common/model/tracked.hpp"
#include "services/ekf/active_map.hpp"
#include "services/ekf/compatible_update.hpp"
#include "services/ekf/counters.hpp"
#include "services/ekf/ekf_report.hpp"
#include "services/ekf/filter_state.hpp"
#include "services/ekf/gates.hpp"
#include "services/ekf/odometry_queue.hpp"
#include "services/ekf/parameters.hpp"
#include "services/ekf/reckoned_track.hpp"
#include "services/ekf/scan_update.hpp"
#include "services/ekf/stationary_monitor.hpp"
#include "services/ekf/timeline.hpp"
#include "services/ekf/vehicle_motion.hpp"

namespace understory::ekf {

/// Odometry and tracked landmarks in; pose, map and biases out. A value: a copy continues like the
/// original. One scan costs O(size^2) per 16 landmarks, `size` = 10 + 2 per landmark.
class Filter {
 public:
  /// Throws std::invalid_argument if `error_form` is not one of the three names.
  explicit Filter(const EkfParameters& parameters);

  /// Adds odometry, which waits for the scan at its end. Late, overlapping and invalid increments
  /// are refused and counted.
  void add(const model::Odometry& increment);
  /// Whether increments have waited for their scan for longer than `max_scan_delay_s`.
  bool has_overdue() const { return queue_.overdue().has_value(); }
  /// Duration of the waiting odometry [s].
  double waiting_s() const { return queue_.waiting_s(); }
  /// Uses the overdue increments, and returns the pose. Precondition: has_overdue().
  EkfOutput go_ahead();
  /// Adds a pose of dead reckoning: the motion over an interval without odometry.
  void add(const model::RawPose& pose);
  /// Pose, map and velocity correction at the scan's stamp; none for a late or repeated scan, nor
  /// before the map begins (EkfPriorParameters::wait_s).
  EkfOutput add(const model::TrackedScan& scan);

  /// Whether a scan with this stamp would be used: it is in order, and the map has begun or begins.
  bool takes_scan_at(model::Utime utime) const;
  /// Counts a restart: earlier outputs are no longer valid; see model::EkfPose::reset_counter.
  void count_restart(const std::string& reason);
  /// Counts since the object was made.
  const EkfCounters& counters() const { return counters_; }
  /// The estimate at utime().
  const FilterState& state() const { return state_; }
  /// Stamp of the estimate; 0 before the map begins.
  model::Utime utime() const { return timeline_.now(); }

  /// The state as bytes: a filter that loads them continues with bitwise equal outputs.
  std::string save() const;
  /// Throws std::invalid_argument, without change, if the bytes are damaged, of another version or
  /// error form, or hold more landmarks than `max_landmarks`.
  void load(const std::string& state);

 private:
  /// Evidence against the estimate.
  struct Doubt {
    int refused_scans = 0;   ///< Consecutive scans of which most landmarks were refused.
    bool is_adrift = false;  ///< After a gap: the vehicle is not localised in the map yet.
    int adrift_scans = 0;    ///< Scans that did not localise it.

    template <class Archive, class Self>
    static void archive(Archive& a, Self& self) {
      a(self.refused_scans, self.is_adrift, self.adrift_scans);
    }
  };

  // Start and restarts.
  void begin(model::Utime utime);
  void restart(model::Utime utime, const std::string& reason, double away_s = 0.0);

  // Stamps and motion.
  bool accept(const model::Odometry& increment);
  bool accept_scan(model::Utime utime);
  void advance(model::Utime utime);
  void use(const model::Odometry& increment);
  void bridge(model::Utime utime);
  void announce_gap(double duration_s, const std::string& reason);

  // One scan.
  ScanUpdate read(const model::TrackedScan& scan);
  bool find_place(const model::TrackedScan& scan, ScanUpdate& update);
  void check_stationary(const ScanUpdate& update);
  void update_known(const model::TrackedScan& scan, ScanUpdate& update);
  void rejoin_lost(const model::TrackedScan& scan, ScanUpdate& update);
  void maintain_map(const model::TrackedScan& scan, const ScanUpdate& update);

  EkfParameters parameters_;
  Gates gates_;            ///< Computed from parameters_.
  UpdateScratch scratch_;  ///< Valid during one message only.
  FilterState state_;
  Timeline timeline_;
  OdometryQueue queue_;
  VehicleMotion motion_;
  ReckonedTrack reckoned_;
  StationaryMonitor stationary_;
  ActiveMap map_;
  EkfReport report_;
  Doubt doubt_;
  EkfCounters counters_;
};

}  // namespace understory::ekf
