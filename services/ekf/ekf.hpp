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

namespace understory::ekf {

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
  std::optional<model::EkfPose> pose;
  std::optional<model::EkfMap> map;
  std::optional<model::VelocityCorrection> correction;
  std::optional<model::EkfLevel> level;  ///< With each pose, where sweeps are levelled.
};

class Ekf {
 public:
  /// Throws std::invalid_argument where `error_form` names none.
  explicit Ekf(const EkfParameters& parameters);

  /// Motion waits for the scan at its end; without one it is used after `max_scan_delay_s`, and a
  /// pose is given then.
  EkfOutput add(const model::Odometry& increment);
  /// Pose, map and velocity correction at the scan's stamp; nothing from a late or repeated scan,
  /// nor before the map begins (EkfPriorParameters::wait_s).
  EkfOutput add(const model::TrackedScan& scan);

  const EkfCounters& counters() const { return counters_; }
  /// The estimate at utime().
  const FilterState& state() const { return state_; }
  model::Utime utime() const { return utime_; }

  std::string save() const;
  void load(const std::string& state);

 private:
  struct Alias {
    model::TrackId track = 0;
    model::TrackId landmark = 0;
  };

  /// Unknown tracks that may be lost landmarks, those with the fewest choices first.
  struct RejoinSearch {
    std::vector<Candidates> candidates;
    double widest_gate_m = 0.0;
    double rotation_variance =
        0.0;  ///< [rad^2] Of the vehicle against the lost landmarks, at most.
  };

  // ekf.cpp: time and motion.
  bool may_begin(const model::Odometry& increment);
  void start(model::Utime utime);
  void restart(model::Utime utime, const std::string& reason);
  void set_prior();
  void advance(model::Utime utime);
  void use(const model::Odometry& increment);
  void predict(const model::Odometry& increment, bool is_stationary);
  bool believes_stationary(const model::Odometry& increment);
  void stand();
  void doubt_stationary();
  void leave_place();
  void bridge(model::Utime utime);
  model::EkfPose pose();
  std::optional<model::EkfLevel> level() const;
  EkfOutput outputs();

  // ekf_scan.cpp: landmarks.
  void read(const model::TrackedScan& scan);
  Observation observation(const model::Detection& seen) const;
  void steady_heights();
  void check_stationary();
  void update_known();
  void update_checked(std::vector<Pairing>& pairings, std::span<const Observation> observations);
  void rejoin_lost(const model::TrackedScan& scan);
  bool rejoin_round(const model::TrackedScan& scan);
  RejoinSearch rejoin_candidates(const model::TrackedScan& scan) const;
  void add_new(const model::TrackedScan& scan);
  void count_missed(const model::FieldOfView& view);
  void remove_distant(const model::FieldOfView& view);
  bool make_room(const model::FieldOfView& view);
  void remove(std::size_t landmark);
  void weaken(const Pairing& pairing);
  void see(const model::TrackedScan& scan, const Pairing& pairing);
  std::optional<std::uint32_t> landmark_of(model::TrackId track) const;
  void check_lost();
  bool near_old(const Eigen::Vector2d& position) const;

  EkfParameters parameters_;
  FilterState state_;
  LowRank room_;
  JointUpdate joint_;
  Eigen::MatrixXd backup_;
  double landmark_gate_ = 0.0;
  double parked_gate_ = 0.0;       ///< Of the marks on the ground, 4 degrees of freedom.
  double creeping_gate_ = 0.0;     ///< 3.
  double still_gate_ = 0.0;        ///< Of the velocity, 2.
  std::vector<double> set_gates_;  ///< By number of landmarks.

  bool started_ = false;
  std::optional<model::Utime> heard_;  ///< Start of the first odometry, while it is not started.
  model::Utime utime_ = 0;
  std::optional<model::Utime> last_scan_;
  std::deque<model::Odometry> waiting_;
  std::uint64_t scan_count_ = 0;
  std::uint64_t pose_sequence_ = 0;
  std::uint64_t map_sequence_ = 0;
  std::uint64_t reset_counter_ = 0;
  int refused_scans_ = 0;
  /// Set: it moves though it is said to stand; when that was last found.
  std::optional<model::Utime> doubted_;
  double distance_m_ = 0.0;  ///< Driven so far.
  /// Covariance of the level's error as the latest odometry has it: what detections have in theirs.
  std::optional<Eigen::Matrix2d> level_covariance_;
  double pitch_tangent_ = 0.0;  ///< Of the vehicle, as the latest odometry has it.
  std::uint32_t used_ = 0;
  std::uint32_t refused_ = 0;
  std::vector<Alias> aliases_;  ///< In order of track.
  model::EkfPose last_sound_;
  EkfCounters counters_;

  // Of the scan at hand.
  std::vector<Observation> observations_;
  std::vector<std::uint32_t> source_;   ///< Index in the scan, per sighting.
  std::vector<model::TrackId> tracks_;  ///< Per sighting.
  std::vector<bool> settled_;           ///< Per sighting: paired, or refused.
  std::vector<Pairing> pairings_;
};

}  // namespace understory::ekf
