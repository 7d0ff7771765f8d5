// Keyframes by joint estimation: scans are tracked singly, then their poses and landmarks are
// estimated together.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/model/detection_noise.hpp"
#include "common/model/ekf_output.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/level.hpp"
#include "common/model/odometry_buffer.hpp"
#include "services/keyframer/joint/bias_track.hpp"
#include "services/keyframer/joint/calibration_watch.hpp"
#include "services/keyframer/joint/member_block.hpp"
#include "services/keyframer/joint/scan_tracker.hpp"
#include "services/keyframer/parameters.hpp"
#include "services/keyframer/reports.hpp"

namespace understory::keyframer::joint {

/// Local bundle adjustment (GeoSLAM §4.2, algorithm 2): n scans become one keyframe. All inputs
/// come in order of time; invalid input is counted and throws no exception. Keyframes are in the
/// frame `centre`, in which the errors of the member poses sum to zero and the correlation of the
/// landmarks' errors is least (block_adjustment.hpp).
class JointKeyframer {
 public:
  /// Starts without landmarks.
  explicit JointKeyframer(const JointKeyframerParameters& parameters);

  /// Adds a scan. One that is not later than the last is refused. A scan with too few matches in
  /// the local map ends the keyframe: the gathered scans (two or more) become a short one. Cost
  /// O(detections) per scan, O(observations n + n^3) for the n-th of a keyframe.
  std::optional<model::Keyframe> add(const model::LandmarkScan& scan);
  /// Keyframes to publish before the one that add() returned; call it after each scan. If a
  /// keyframe has one or two scans, the first ones wait until three more scans show the scatter of
  /// detections: the map's frame would keep an error from wrongly stated noise.
  std::vector<model::Keyframe> take_waited() { return std::exchange(waited_, {}); }
  /// Motion of the vehicle by wheels or IMU, if available. It must arrive before the scan at its
  /// end. It predicts the next scan and bridges scans with few landmarks. Increments that overlap
  /// or run backwards are ignored.
  void add(const model::Odometry& odometry);
  /// The filter's estimate of the roll and pitch error: scans within 2 s of its utime are corrected
  /// by it.
  void add(const model::EkfLevel& level) { level_.set(level); }

  /// Quality of the scans and of odometry.
  InputQuality input_quality() const {
    return {noise_.is_adjusting(), calibration_.error(), calibration_.lately(),
            calibration_.contradicts()};
  }
  /// Counts for HEALTH.
  const KeyframerCounters& counters() const { return counters_; }

  /// The format is "keyframer.joint" of common/state.
  std::string save() const;
  /// Throws std::invalid_argument on other bytes; the state is then unchanged.
  void load(const std::string& bytes);

  /// Members of a saved state; see common/state. The parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.tracker_, self.noise_, self.calibration_, self.odometry_, self.bias_, self.level_,
      self.members_, self.waiting_, self.waited_, self.last_utime_, self.interval_us_,
      self.next_sequence_, self.local_T_previous_base_, self.counters_);
  }

 private:
  std::optional<model::Keyframe> refuse(std::string reason);
  std::optional<model::Keyframe> start_anew(const model::LandmarkScan& scan);
  std::optional<PlacedScan> place(const model::LandmarkScan& stated,
                                  const std::optional<geometry::SE2WithCovariance>& motion);
  std::optional<PlacedScan> place_by_tries(
      const model::LandmarkScan& stated, const std::optional<geometry::SE2WithCovariance>& motion);
  void gather(Member member);
  bool is_full() const;
  bool is_after_pause(model::Utime utime) const;
  std::optional<model::Keyframe> finish();
  std::optional<model::Keyframe> break_off();
  void stop_waiting();
  std::optional<model::Keyframe> estimated(std::vector<Member> members);
  MemberBlock adjusted(std::span<const Member> members);

  JointKeyframerParameters parameters_;
  ScanTracker tracker_;
  model::DetectionNoise noise_;
  CalibrationWatch calibration_;
  model::OdometryBuffer odometry_;
  BiasTrack bias_;
  model::LevelCorrection level_;
  std::vector<Member> members_;               ///< Of the present keyframe; with noise as stated.
  std::vector<std::vector<Member>> waiting_;  ///< Of the first keyframes.
  std::vector<model::Keyframe> waited_;
  std::optional<model::Utime> last_utime_;
  model::Utime interval_us_ = 0;  ///< Between the last two scans; 0 = unknown.
  std::uint64_t next_sequence_ = 0;
  std::optional<geometry::SE2> local_T_previous_base_;  ///< None after a restart of tracking.
  KeyframerCounters counters_;
};

}  // namespace understory::keyframer::joint
