// The scans of one keyframe as one estimation problem.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/model/keyframe.hpp"
#include "common/model/landmarks.hpp"
#include "services/keyframer/joint/block_adjustment.hpp"
#include "services/keyframer/joint/scan_tracker.hpp"

namespace understory::keyframer::joint {

/// A scan of the keyframe that is being gathered.
struct Member {
  model::LandmarkScan scan;
  PlacedScan placed;
  std::optional<geometry::SE2WithCovariance> motion;  ///< Since the scan before, by odometry.
  std::optional<model::InertialMotion> inertial;      ///< The same by the IMU.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.scan, self.placed, self.motion, self.inertial);
  }
};

/// The problem and its solution, with the track behind each landmark.
struct MemberBlock {
  BlockProblem problem;
  std::vector<TrackNumber> tracks;  ///< Of each landmark of the problem.
  BlockEstimate estimate;
};

/// What an estimate of the members takes beside their observations.
struct BlockRules {
  int min_observations = 2;        ///< A track with fewer observations is left out.
  double motion_sigma_m = 0.3;     ///< Of a member's motion that nothing determines, per axis.
  double motion_sigma_rad = 0.04;  ///< Of its rotation.
  BiasEstimate bias;               ///< Of the IMU, before the first member.
};

/// Estimates the members' poses and the landmarks of their tracks together. Tracks with fewer than
/// `min_observations` observations and doubtful ones are left out, and of more than 1000 those that
/// were observed least; so are outliers, by their chi^2, in at most two rounds. Where landmarks and
/// odometry leave a motion undetermined, the one that was tracked counts with the sigmas of
/// `rules`. An IMU counts unless it contradicts what was observed. Precondition: there is a
/// member.
MemberBlock adjust_members(std::span<const Member> members, const LocalMap& map,
                           const BlockRules& rules);

/// Why the estimate is not good enough for a keyframe; nothing where it is.
std::optional<std::string> why_unusable(std::span<const Member> members, const MemberBlock& block);

/// The keyframe of a usable estimate, without sequence and previous_T_base. The caller sets these.
model::Keyframe to_keyframe(std::span<const Member> members, const MemberBlock& block,
                            const LocalMap& map);

}  // namespace understory::keyframer::joint
