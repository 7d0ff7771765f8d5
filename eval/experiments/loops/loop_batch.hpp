// The batch solution of a drive: what is possible on its detections and odometry.
#pragma once

#include <vector>

#include "common/geometry/se2.hpp"
#include "eval/experiments/loops/loop_drive.hpp"

namespace understory::eval::experiments::loops {

/// Poses of all frames, first_T_vehicle, by least squares on all odometry and all detections with
/// their true trees, from the true poses on. Detections count by the noise that their residuals
/// show, whatever is stated. Throws std::runtime_error where it does not converge.
std::vector<geometry::SE2> batch_poses(const LoopDrive& drive);

}  // namespace understory::eval::experiments::loops
