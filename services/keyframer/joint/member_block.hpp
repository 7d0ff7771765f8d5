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

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.scan, self.placed, self.motion);
  }
};

/// The problem and its solution, with the track behind each landmark.
struct MemberBlock {
  BlockProblem problem;
  std::vector<TrackNumber> tracks;  ///< Of each landmark of the problem.
  BlockEstimate estimate;
};

/// Estimates the members' poses and the landmarks of their tracks together. Tracks with fewer than
/// `min_observations` observations and doubtful ones are left out, and of more than 1000 those that
/// were observed least; so are outliers, by their chi^2,
/// in at most two rounds. Precondition: there is a member.
MemberBlock adjust_members(std::span<const Member> members, const LocalMap& map,
                           int min_observations);

/// Why the estimate is not good enough for a keyframe; nothing where it is.
std::optional<std::string> why_unusable(std::span<const Member> members, const MemberBlock& block);

/// The keyframe of a usable estimate, without sequence and previous_T_base. The caller sets these.
model::Keyframe to_keyframe(std::span<const Member> members, const MemberBlock& block,
                            const LocalMap& map);

}  // namespace understory::keyframer::joint
