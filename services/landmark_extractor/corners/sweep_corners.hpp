// Corners of houses: intersections of two upright walls at about a right angle.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/model/landmarks.hpp"
#include "services/landmark_extractor/corners/corner_pair.hpp"
#include "services/landmark_extractor/corners/wall_lines.hpp"
#include "services/landmark_extractor/ground/ground_surface.hpp"

namespace understory::landmark_extractor::corners {

/// Counts of walls and their pairs since the start.
struct CornerCounters {
  std::uint64_t walls = 0;    ///< Found.
  std::uint64_t pairs = 0;    ///< Pairs of walls that meet.
  std::uint64_t skew = 0;     ///< Not at a right angle.
  std::uint64_t low = 0;      ///< Ends below a person's height: a car, a hedge, a box.
  std::uint64_t hidden = 0;   ///< These two faces are not visible together from the sensor.
  std::uint64_t corners = 0;  ///< Published.
};

/// Finds the corners of houses in one sweep. Reuses memory between sweeps, but has no state.
class SweepCorners {
 public:
  /// `sweep`: parameters common with trunks.
  SweepCorners(const SweepParameters& sweep, const CornerParameters& corner)
      : sweep_(sweep), corner_(corner), walls_(sweep, corner) {}

  /// Appends the corners to `detections`, frame `vehicle_level`: position at breast height, bearing
  /// out of the house. `level_covariance_rad2`: of (roll, pitch).
  void find(const rings::RingCloud& cloud, const std::vector<rings::Run>& runs,
            const ground::GroundSurface& ground, const Eigen::Matrix2d& level_covariance_rad2,
            std::vector<model::Detection>& detections);
  const CornerCounters& counters() const { return counters_; }  ///< Since the start.
  /// The walls of the last sweep.
  const std::vector<WallLine>& walls() const { return found_; }

 private:
  /// The corner of two walls; else none, and the reason is counted.
  std::optional<model::Detection> judge(const rings::RingCloud& cloud, const WallLine& a,
                                        const WallLine& b, const ground::GroundSurface& ground,
                                        const Eigen::Matrix2d& level_covariance_rad2);
  bool is_tall(const rings::RingCloud& cloud, const WallLine& wall, const Eigen::Vector2d& corner,
               const Eigen::Vector2d& along, double ground_z) const;

  SweepParameters sweep_;
  CornerParameters corner_;
  WallFinder walls_;
  std::vector<WallLine> found_;
  CornerCounters counters_;
};

}  // namespace understory::landmark_extractor::corners
