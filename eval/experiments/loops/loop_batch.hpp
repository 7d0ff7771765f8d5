// The batch solution of a drive: what is possible on its detections and odometry.
#pragma once

#include <vector>

#include "common/geometry/se2.hpp"
#include "eval/experiments/loops/loop_drive.hpp"
#include "eval/experiments/loops/loop_run.hpp"

namespace understory::eval::experiments::loops {

/// Which detections show one tree.
enum class Association {
  kTrue,         ///< All of them, as it is.
  kRecognisable  ///< A tree that comes back into sight (100 m of path) is the one before only where
                 ///< five trees of the last 40 m were there before: fewer could be anywhere.
};

/// Poses of all frames, first_T_vehicle, by least squares on all odometry and all detections with
/// their trees, from the true poses on. Detections count by the noise that their residuals show,
/// whatever is stated. Throws std::runtime_error where it does not converge.
std::vector<geometry::SE2> batch_poses(const LoopDrive& drive, Association association);

/// Their errors from frame `first` on, whose pose is held: that of the keyframe with which the
/// mapper's map begins. Throws as batch_poses().
PathErrors batch_errors(const LoopDrive& drive, std::size_t first, Association association);

}  // namespace understory::eval::experiments::loops
