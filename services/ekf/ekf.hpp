// EKF-SLAM in the plane on odometry and tracked landmarks ("EKF Node", section 3.2.3 of the vehicle
// stack's source).
#pragma once

#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/model/ekf_output.hpp"
#include "common/model/odometry.hpp"
#include "common/model/tracked.hpp"
#include "services/ekf/filter_state.hpp"
#include "services/ekf/joint_compatibility.hpp"
#include "services/ekf/landmark_update.hpp"
#include "services/ekf/low_rank.hpp"
#include "services/ekf/parameters.hpp"

namespace understory {

/// What was refused and why; counted for HEALTH.
struct EkfCounters {
  std::uint64_t odometry = 0;
  std::uint64_t odometry_refused = 0;  ///< Late, twice, or not finite.
  std::uint64_t gaps = 0;              ///< Intervals that no odometry covered.
  std::uint64_t scans = 0;
  std::uint64_t scans_refused = 0;  ///< Late or twice.
  std::uint64_t landmarks_used = 0;
  std::uint64_t landmarks_refused = 0;   ///< By their own gate or the set's.
  std::uint64_t landmarks_unusable = 0;  ///< Not finite, or no covariance.
  std::uint64_t landmarks_too_near = 0;  ///< New ones, to an old one; or the state was full.
  std::uint64_t rejoined = 0;            ///< Lost landmarks that a new track was found to be.
  std::uint64_t removed = 0;             ///< Landmarks that left the active state.
  std::uint64_t crept = 0;               ///< Times that it moved while it was said to stand.
  std::uint64_t restarts = 0;
  std::string last_reason;
};

struct EkfOutput {
  std::optional<EkfPose> pose;
  std::optional<EkfMap> map;
  std::optional<VelocityCorrection> correction;
  std::optional<EkfLevel> level;  ///< With each pose, where sweeps are levelled.
};

class Ekf {
 public:
  /// Throws std::invalid_argument where `error_form` names none.
  explicit Ekf(const EkfParameters& parameters);

  /// Motion waits for the scan at its end; without one it is used after `max_scan_delay_s`, and a
  /// pose is given then.
  EkfOutput add(const Odometry& piece);
  /// Pose, map and velocity correction at the scan's stamp; nothing from a late or repeated scan,
  /// nor before the map begins (EkfPriorParameters::wait_s).
  EkfOutput add(const TrackedScan& scan);

  const EkfCounters& counters() const { return counters_; }
  /// The estimate at utime().
  const ekf::FilterState& state() const { return state_; }
  Utime utime() const { return utime_; }

  std::string save() const;
  void load(const std::string& state);

 private:
  struct Alias {
    TrackId track = 0;
    TrackId landmark = 0;
  };

  /// Unknown tracks that may be lost landmarks, those with the fewest choices first.
  struct RejoinSearch {
    std::vector<ekf::Candidates> candidates;
    double widest_gate_m = 0.0;
    double turn_variance = 0.0;  ///< [rad^2] Of the vehicle against the lost landmarks, at most.
  };

  // ekf.cpp: time and motion.
  bool may_begin(const Odometry& piece);
  void start(Utime utime);
  void restart(Utime utime, const std::string& reason);
  void set_prior();
  void advance(Utime utime);
  void use(const Odometry& piece);
  void predict(const Odometry& piece, bool stands);
  bool believes_standing(const Odometry& piece);
  void stand();
  void doubt_standing();
  void leave_place();
  void bridge(Utime utime);
  EkfPose pose();
  std::optional<EkfLevel> level() const;
  EkfOutput outputs();

  // ekf_scan.cpp: landmarks.
  void read(const TrackedScan& scan);
  ekf::Sighting sighting(const Detection& seen) const;
  void steady_heights();
  void check_standing();
  void update_known();
  void update_checked(std::vector<ekf::Pairing>& pairings,
                      std::span<const ekf::Sighting> sightings);
  void rejoin_lost(const TrackedScan& scan);
  bool rejoin_round(const TrackedScan& scan);
  RejoinSearch rejoin_candidates(const TrackedScan& scan) const;
  void add_new(const TrackedScan& scan);
  void count_missed(const FieldOfView& view);
  void remove_distant(const FieldOfView& view);
  bool make_room(const FieldOfView& view);
  void remove(std::size_t landmark);
  void weaken(const ekf::Pairing& pairing);
  void see(const TrackedScan& scan, const ekf::Pairing& pairing);
  std::optional<std::uint32_t> landmark_of(TrackId track) const;
  void check_lost();
  bool near_old(const Eigen::Vector2d& position) const;

  EkfParameters parameters_;
  ekf::FilterState state_;
  ekf::LowRank room_;
  ekf::JointUpdate joint_;
  Eigen::MatrixXd backup_;
  double landmark_gate_ = 0.0;
  double parked_gate_ = 0.0;       ///< Of the marks on the ground, 4 degrees of freedom.
  double creeping_gate_ = 0.0;     ///< 3.
  double still_gate_ = 0.0;        ///< Of the velocity, 2.
  std::vector<double> set_gates_;  ///< By number of landmarks.

  bool started_ = false;
  std::optional<Utime> heard_;  ///< Start of the first odometry, while it is not started.
  Utime utime_ = 0;
  std::optional<Utime> last_scan_;
  std::deque<Odometry> waiting_;
  std::uint64_t scan_count_ = 0;
  std::uint64_t pose_sequence_ = 0;
  std::uint64_t map_sequence_ = 0;
  std::uint64_t reset_counter_ = 0;
  int refused_scans_ = 0;
  /// Set: it moves though it is said to stand; when that was last found.
  std::optional<Utime> doubted_;
  double way_m_ = 0.0;  ///< Driven so far.
  /// Covariance of the level's error as the latest odometry has it: what detections have in theirs.
  std::optional<Eigen::Matrix2d> level_covariance_;
  double pitch_tangent_ = 0.0;  ///< Of the vehicle, as the latest odometry has it.
  std::uint32_t used_ = 0;
  std::uint32_t refused_ = 0;
  std::vector<Alias> aliases_;  ///< In order of track.
  EkfPose last_sound_;
  EkfCounters counters_;

  // Of the scan at hand.
  std::vector<ekf::Sighting> sightings_;
  std::vector<std::uint32_t> source_;  ///< Index in the scan, per sighting.
  std::vector<TrackId> tracks_;        ///< Per sighting.
  std::vector<bool> settled_;          ///< Per sighting: paired, or refused.
  std::vector<ekf::Pairing> pairings_;
};

}  // namespace understory
