// Where two walls meet in the plan: a corner of a house, or none.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/model/landmarks.hpp"
#include "services/landmark_extractor/corners/wall_lines.hpp"

namespace understory::landmark_extractor::corners {

/// Where two walls meet, from the corner along each.
struct Meeting {
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d along_a = Eigen::Vector2d::Zero();
  Eigen::Vector2d along_b = Eigen::Vector2d::Zero();
  double reach_a_m = 0.0;  ///< From the centroid of wall a.
  double reach_b_m = 0.0;
};

/// Where the lines meet, if both walls are measured up to there and at the same heights. `sensor`:
/// in the plan.
std::optional<Meeting> meet(const WallLine& a, const WallLine& b, const Eigen::Vector2d& sensor,
                            const CornerParameters& parameters);
/// Of the angle between the walls from a right one [rad].
double skew_rad(const Meeting& meeting);

/// From which side the sensor sees both faces.
enum class Side : std::uint8_t { kFront, kWithin };
/// None where the sensor cannot see both.
std::optional<Side> side_of(const Meeting& meeting, const Eigen::Vector2d& sensor);

/// The corner in the plan: position, covariance from the two lines, bearing out of the house. Its
/// height is left to the caller.
model::Detection corner_at(const Meeting& meeting, const WallLine& a, const WallLine& b, Side side);
/// What an error of roll and pitch adds to the covariance of a corner at `position_m`.
Eigen::Matrix3d from_level_error(const Eigen::Vector3d& position_m, const WallLine& a,
                                 const WallLine& b, const Eigen::Matrix2d& level_covariance_rad2);

/// Adds a corner to those from `first` on. Windows and doors make several walls of one: the edge of
/// a house is given once, by the pair with the smallest covariance.
void add_once(const model::Detection& corner, const CornerParameters& parameters, std::size_t first,
              std::vector<model::Detection>& detections);

}  // namespace understory::landmark_extractor::corners
