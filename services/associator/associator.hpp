// Association of detections with landmarks, from scan to scan ("Association Node", vehicle stack
// §3.2.2).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/model/detection_noise.hpp"
#include "common/model/ekf_output.hpp"
#include "common/model/odometry.hpp"
#include "common/model/tracked.hpp"
#include "services/associator/match.hpp"
#include "services/associator/motion_predictor.hpp"
#include "services/associator/parameters.hpp"
#include "services/associator/scan_localiser.hpp"
#include "services/associator/track_list.hpp"

namespace understory::associator {

/// Counts for HEALTH, since the process started.
struct AssociatorCounters {
  std::uint64_t scans = 0;                ///< Received.
  std::uint64_t scans_refused = 0;        ///< Late or repeated.
  std::uint64_t scans_passed_over = 0;    ///< Fitted no track; the tracks were kept.
  std::uint64_t scans_lost = 0;           ///< Fitted no track once more; all tracks began anew.
  std::uint64_t detections = 0;           ///< Received.
  std::uint64_t detections_unusable = 0;  ///< Not finite, or without a covariance.
  std::uint64_t published = 0;            ///< Detections with a track id.
  std::uint64_t ambiguous = 0;            ///< Matched, but not published.
  std::string last_reason;                ///< Why the last scan was not used.
};

/// Gives the detections of consistent landmarks an id that lasts as long as the track.
///
/// It works in the frame `local`, which drifts slowly. All inputs come in order of time; invalid
/// input is counted and throws no exception.
class Associator {
 public:
  /// Throws std::invalid_argument if `method` is unknown.
  explicit Associator(const AssociatorParameters& parameters);

  /// Motion of the vehicle; it must arrive before the scan at its end.
  void add(const model::Odometry& increment) { motion_.add(increment); }
  /// The filter's pose at the last scan: its velocity and biases predict the next motion. It never
  /// changes a track.
  void add(const model::EkfPose& pose) { motion_.add(pose); }
  /// The consistent landmarks of a scan (perhaps none). Covariances are estimated from the scans if
  /// the stated ones contradict them (DetectionNoise). None for a late or repeated scan; a scan
  /// more than 10 s earlier than the last one starts the tracks anew (the clock was set back).
  std::optional<model::TrackedScan> add(const model::LandmarkScan& scan);

  /// Counts for HEALTH.
  const AssociatorCounters& counters() const { return counters_; }
  /// Whether the scans contradict the covariances of LANDMARKS and the estimate that replaces them
  /// has not settled yet.
  bool is_noise_misstated() const { return noise_.is_adjusting(); }
  /// Number of tracks, consistent or not.
  std::size_t track_count() const { return tracks_.tracks().size(); }

  /// The whole state as bytes, in the format "associator" of common/state.
  std::string save() const;
  /// Throws std::invalid_argument on other bytes than those of save(); the state is then unchanged.
  void load(const std::string& bytes);

  /// Members of a saved state; see common/state. The parameters are configuration, and the counters
  /// restart with the process.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.tracks_, self.noise_, self.motion_, self.local_T_vehicle_, self.misfits_,
      self.next_sequence_);
  }

 private:
  bool is_in_time(const model::LandmarkScan& scan);
  Localisation locate(const std::vector<Observation>& observations,
                      const model::LandmarkScan& scan);
  void locate_rescaled(const model::LandmarkScan& stated, std::vector<Observation>& observations,
                       Localisation& located);
  std::vector<std::uint64_t> numbers_of(const std::vector<Observation>& observations,
                                        const std::vector<Match>& matches,
                                        const model::LandmarkScan& scan) const;
  bool pass_over();
  std::vector<model::TrackId> update_tracks(const std::vector<Observation>& observations,
                                            const std::vector<Match>& matches,
                                            const model::LandmarkScan& scan);
  model::TrackedScan tracked_scan(const std::vector<Observation>& observations,
                                  const std::vector<model::TrackId>& ids,
                                  const model::LandmarkScan& scan);

  AssociatorParameters parameters_;
  TrackList tracks_;
  model::DetectionNoise noise_;
  MotionPredictor motion_;
  geometry::SE2 local_T_vehicle_;  ///< At the last scan that was located.
  int misfits_ = 0;                ///< Successive scans that fitted no track.
  std::uint64_t next_sequence_ = 0;
  AssociatorCounters counters_;
};

}  // namespace understory::associator
