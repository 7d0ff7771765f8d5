// Corners of houses: where two upright walls meet at about a right angle.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/model/landmarks.hpp"
#include "services/landmark_extractor/corners/corner_pair.hpp"
#include "services/landmark_extractor/corners/wall_lines.hpp"
#include "services/landmark_extractor/ground/ground_surface.hpp"

namespace understory::landmark_extractor::corners {

/// What became of walls and their pairs since the start.
struct CornerCounters {
  std::uint64_t walls = 0;    ///< Found.
  std::uint64_t pairs = 0;    ///< Walls that meet.
  std::uint64_t skew = 0;     ///< At no right angle.
  std::uint64_t low = 0;      ///< Ends below a person's height: a car, a hedge, a box.
  std::uint64_t hidden = 0;   ///< From the sensor's place these two faces cannot both be seen.
  std::uint64_t corners = 0;  ///< Given out.
};

/// Finds the edges of houses in one sweep. Keeps its memory from sweep to sweep, but no state.
class SweepCorners {
 public:
  /// `sweep`: what is common with trunks.
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
  /// The corner of two walls, or none and a count why.
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
