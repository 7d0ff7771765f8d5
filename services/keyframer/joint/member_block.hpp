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

/// A scan of the present keyframe.
struct Member {
  model::LandmarkScan scan;
  PlacedScan placed;
  std::optional<geometry::SE2WithCovariance> motion;  ///< Since the previous scan, by odometry.
  std::optional<model::InertialMotion> inertial;      ///< The same by the IMU.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.scan, self.placed, self.motion, self.inertial);
  }
};

/// The problem and its solution, with the track of each landmark.
struct MemberBlock {
  BlockProblem problem;
  std::vector<TrackNumber> tracks;  ///< For each landmark of the problem.
  BlockEstimate estimate;
};

/// Rules of the estimate beside the observations.
struct BlockRules {
  int min_observations = 2;        ///< A track with fewer observations is excluded.
  double motion_sigma_m = 0.3;     ///< Of a member's undetermined motion, per axis.
  double motion_sigma_rad = 0.04;  ///< Of its rotation.
  BiasEstimate bias;               ///< Of the IMU, before the first member.
};

/// Estimates the members' poses and the landmarks of their tracks together. Excluded: doubtful
/// tracks, those with fewer than `min_observations` observations, beyond 1000 tracks the least
/// observed; and outliers, by their chi^2, in at most two rounds. If landmarks and odometry leave a
/// motion undetermined, the tracked motion is used with the sigmas of `rules`. An IMU is used
/// unless it contradicts the observations. Precondition: there is a member.
MemberBlock adjust_members(std::span<const Member> members, const LocalMap& map,
                           const BlockRules& rules);

/// Reason why the estimate is not good enough for a keyframe; none if it is.
std::optional<std::string> why_unusable(std::span<const Member> members, const MemberBlock& block);

/// The keyframe of a usable estimate, without sequence and previous_T_base. The caller sets these.
model::Keyframe to_keyframe(std::span<const Member> members, const MemberBlock& block,
                            const LocalMap& map);

}  // namespace understory::keyframer::joint
