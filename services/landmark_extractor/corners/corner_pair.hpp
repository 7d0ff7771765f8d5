// Intersection of two walls in the plan: a corner of a house, or none.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/model/landmarks.hpp"
#include "services/landmark_extractor/corners/wall_lines.hpp"

namespace understory::landmark_extractor::corners {

/// Intersection of two walls, with directions from the corner along each.
struct Meeting {
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d along_a = Eigen::Vector2d::Zero();
  Eigen::Vector2d along_b = Eigen::Vector2d::Zero();
  double reach_a_m = 0.0;  ///< From the centroid of wall a.
  double reach_b_m = 0.0;
};

/// The intersection, if both walls are measured up to it and at the same heights. `sensor`: in the
/// plan.
std::optional<Meeting> meet(const WallLine& a, const WallLine& b, const Eigen::Vector2d& sensor,
                            const CornerParameters& parameters);
/// Deviation of the angle between the walls from a right angle [rad].
double skew_rad(const Meeting& meeting);

/// Position of the sensor relative to the corner.
enum class Side : std::uint8_t { kFront, kWithin };
/// None if the sensor cannot see both faces.
std::optional<Side> side_of(const Meeting& meeting, const Eigen::Vector2d& sensor);

/// The corner in the plan: position, covariance from the two lines, bearing out of the house. The
/// caller sets its height.
model::Detection corner_at(const Meeting& meeting, const WallLine& a, const WallLine& b, Side side);
/// Contribution of the roll and pitch error to the covariance of a corner at `position_m`.
Eigen::Matrix3d from_level_error(const Eigen::Vector3d& position_m, const WallLine& a,
                                 const WallLine& b, const Eigen::Matrix2d& level_covariance_rad2);

/// Adds a corner to those from `first` on. Windows and doors divide a wall into several: a corner
/// of a house is reported once, by the pair with the smallest covariance.
void add_once(const model::Detection& corner, const CornerParameters& parameters, std::size_t first,
              std::vector<model::Detection>& detections);

}  // namespace understory::landmark_extractor::corners
