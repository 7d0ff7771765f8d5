// Corners of houses in a scan of one plane.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/model/landmarks.hpp"
#include "services/landmark_extractor/corners/sweep_corners.hpp"
#include "services/landmark_extractor/corners/wall_lines.hpp"
#include "services/landmark_extractor/planar/beams.hpp"

namespace understory::landmark_extractor::planar {

/// Walls and their intersections as in 3-D, but from one ring. A plane does not show an object's
/// height: instead, with `min_length_m` both faces must be longer than the width of a car. Reuses
/// memory between scans, but has no state.
class ScanCorners {
 public:
  /// `laser`: noise and range. `corner.min_rings` and `corner.min_extent_m` are not used.
  ScanCorners(const PlanarTrunkParameters& laser, const CornerParameters& corner);

  /// Appends the corners to `detections`, in the frame of the beams; height `height_m`.
  /// `level_covariance_rad2`: of (roll, pitch).
  void find(const Beams& scan, double height_m, const Eigen::Matrix2d& level_covariance_rad2,
            std::vector<model::Detection>& detections);
  const corners::CornerCounters& counters() const { return counters_; }  ///< Since the start.

 private:
  void take_points(const Beams& scan);
  std::optional<model::Detection> judge(const corners::WallLine& a, const corners::WallLine& b,
                                        const Eigen::Vector2d& sensor);

  PlanarTrunkParameters laser_;
  CornerParameters corner_;
  corners::WallFinder finder_;
  std::vector<points::RingPoint> points_;
  std::vector<rings::Run> runs_;
  corners::CornerCounters counters_;
};

}  // namespace understory::landmark_extractor::planar
