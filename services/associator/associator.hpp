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

namespace understory::associator {

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
  void add(const model::Odometry& increment);
  /// The filter's pose at an earlier scan: its velocity and biases predict the next motion. Never
  /// changes a track.
  void add(const model::EkfPose& pose);
  /// The consistent landmarks of a scan (perhaps none); nothing from a late or repeated scan.
  std::optional<model::TrackedScan> add(const model::LandmarkScan& scan);

  const AssociatorCounters& counters() const { return counters_; }
  std::size_t track_count() const { return tracks_.tracks().size(); }

  std::string save() const;
  void load(const std::string& state);

 private:
  std::optional<geometry::SE2WithCovariance> motion_to(model::Utime utime) const;
  std::optional<geometry::SE2WithCovariance> motion_by_wheels(model::Utime from,
                                                              model::Utime to) const;
  std::optional<geometry::SE2WithCovariance> motion_by_filter(model::Utime utime) const;
  geometry::Registration locate(const std::vector<Seen>& seen, const model::FieldOfView& view,
                                model::Utime utime);
  geometry::Registration search(const std::vector<Seen>& seen,
                                const geometry::SE2WithCovariance& guess,
                                const geometry::RegistrationParameters& registration);
  model::TrackedScan publish(const model::LandmarkScan& scan, const std::vector<Seen>& seen,
                             const std::vector<Match>& matches,
                             const geometry::SE2& local_T_vehicle);
  bool fits(const geometry::Registration& registration, std::size_t seen,
            const model::FieldOfView& view) const;

  AssociatorParameters parameters_;
  TrackList tracks_;
  model::OdometryBuffer odometry_;
  std::optional<model::EkfPose> filter_pose_;
  std::optional<model::Utime> last_scan_;
  double last_interval_s_ = 0.1;
  geometry::SE2 local_T_vehicle_;
  geometry::SE2 last_motion_;
  int misfits_ = 0;  ///< Scans in a row that fitted no track.
  std::uint64_t next_sequence_ = 0;
  AssociatorCounters counters_;
};

}  // namespace understory::associator
