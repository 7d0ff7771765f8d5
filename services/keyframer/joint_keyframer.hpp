// Our keyframes: scans are tracked one by one, then their poses and landmarks are estimated
// together.
#pragma once

#include "common/model/level.hpp"
#include "common/model/odometry_buffer.hpp"
#include "services/keyframer/block_adjustment.hpp"
#include "services/keyframer/keyframer.hpp"
#include "services/keyframer/scan_tracker.hpp"

namespace understory::keyframer {

class JointKeyframer final : public KeyframerMethod {
 public:
  explicit JointKeyframer(const JointKeyframerParameters& parameters);

  std::optional<model::Keyframe> add(const model::LandmarkScan& scan) override;
  void add(const model::Odometry& odometry) override;
  void add(const model::EkfPose& pose) override { odometry_.set_filter_pose(pose); }
  void add(const model::EkfLevel& level) override { level_.set(level); }
  const KeyframerCounters& counters() const override { return counters_; }
  std::string save() const override;
  void load(const std::string& state) override;

 private:
  struct Member {
    model::LandmarkScan scan;
    FollowedScan tracked;
    std::optional<geometry::SE2WithCovariance> motion;  ///< Since the member before.
  };

  std::optional<model::Keyframe> finish();
  std::optional<model::Keyframe> lost(const model::LandmarkScan& scan);
  BlockProblem problem(std::vector<std::uint32_t>& tracks) const;
  model::Keyframe keyframe(const BlockProblem& problem, const BlockEstimate& estimate,
                           const std::vector<std::uint32_t>& tracks);

  JointKeyframerParameters parameters_;
  ScanTracker tracker_;
  /// A keyframe takes less than a second: so long its scans share what the bias is off by.
  model::OdometryBuffer odometry_{0.8};
  std::vector<Member> members_;
  std::optional<model::Utime> last_utime_;
  std::uint64_t next_sequence_ = 0;
  std::optional<geometry::SE2> local_T_previous_base_;
  model::LevelCorrection level_;
  KeyframerCounters counters_;
};

}  // namespace understory::keyframer
