// Which detection is which landmark, from scan to scan ("Association Node", section 3.2.2 of the
// vehicle stack's source).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/geometry/registration.hpp"
#include "common/model/ekf_output.hpp"
#include "common/model/odometry_buffer.hpp"
#include "common/model/tracked.hpp"
#include "services/associator/parameters.hpp"
#include "services/associator/track_list.hpp"

namespace understory {

/// Counted for HEALTH.
struct AssociatorCounters {
  std::uint64_t scans = 0;
  std::uint64_t scans_refused = 0;         ///< Late or twice.
  std::uint64_t scans_passed_over = 0;     ///< Fitted no track: nothing was made of it.
  std::uint64_t scans_lost = 0;            ///< Fitted no track once more: all tracks began anew.
  std::uint64_t scans_without_motion = 0;  ///< Nothing but the last motion predicted them.
  std::uint64_t detections = 0;
  std::uint64_t detections_unusable = 0;  ///< Not finite, or no covariance.
  std::uint64_t published = 0;
  std::uint64_t ambiguous = 0;  ///< Matched, but not published.
  std::uint64_t tracks_confirmed = 0;
  std::uint64_t searches = 0;  ///< For the largest consistent set.
  std::string last_reason;
};

class Associator {
 public:
  /// Throws std::invalid_argument where `method` names none.
  explicit Associator(const AssociatorParameters& parameters);

  /// Motion since the last scan; must come before the scan at its end to be of use.
  void add(const Odometry& piece);
  /// The filter's pose at an earlier scan: its velocity and biases predict the next motion. Never
  /// changes a track.
  void add(const EkfPose& pose);
  /// The consistent landmarks of a scan (perhaps none); nothing from a late or repeated scan.
  std::optional<TrackedScan> add(const LandmarkScan& scan);

  const AssociatorCounters& counters() const { return counters_; }
  std::size_t track_count() const { return tracks_.tracks().size(); }

  std::string save() const;
  void load(const std::string& state);

 private:
  std::optional<SE2WithCovariance> motion_to(Utime utime) const;
  std::optional<SE2WithCovariance> motion_by_wheels(Utime from, Utime to) const;
  std::optional<SE2WithCovariance> motion_by_filter(Utime utime) const;
  Registration locate(const std::vector<associator::Seen>& seen, const FieldOfView& view,
                      Utime utime);
  Registration search(const std::vector<associator::Seen>& seen, const SE2WithCovariance& guess,
                      const RegistrationParameters& registration);
  TrackedScan publish(const LandmarkScan& scan, const std::vector<associator::Seen>& seen,
                      const std::vector<associator::Match>& matches, const SE2& local_T_vehicle);
  bool fits(const Registration& registration, std::size_t seen, const FieldOfView& view) const;

  AssociatorParameters parameters_;
  associator::TrackList tracks_;
  OdometryBuffer odometry_;
  std::optional<EkfPose> filter_pose_;
  std::optional<Utime> last_scan_;
  double last_interval_s_ = 0.1;
  SE2 local_T_vehicle_;
  SE2 last_motion_;
  int misfits_ = 0;  ///< Scans in a row that fitted no track.
  std::uint64_t next_sequence_ = 0;
  AssociatorCounters counters_;
};

}  // namespace understory
