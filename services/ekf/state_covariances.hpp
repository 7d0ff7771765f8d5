// Pose, velocity and landmarks of the filter's state in output frames.
#pragma once

#include <cstddef>

#include "services/ekf/filter_state.hpp"
#include "services/ekf/parameters.hpp"

namespace understory::ekf {

/// ekf_map_T_vehicle.
geometry::SE2 vehicle_pose(const FilterState& state);

/// Covariance of vehicle_pose(): tangent order (x, y, theta) [m, m, rad], right perturbation.
Eigen::Matrix3d pose_covariance(const FilterState& state);

/// Covariance of the published pose, whose heading is the state's less `pitch_tangent` times the
/// error of the roll. Order as pose_covariance().
Eigen::Matrix3d pose_covariance(const FilterState& state, double pitch_tangent);

/// Sets the covariance of the pose (order as pose_covariance()) and its correlation with the rest
/// of the state to zero.
void set_pose_covariance(FilterState& state, const Eigen::Matrix3d& covariance);

/// Covariance of (velocity [m/s], bias), the velocity in the axes of the vehicle.
Eigen::Matrix<double, 5, 5> velocity_covariance(const FilterState& state);

/// Covariance of landmark `i` in the axes of the map [m^2].
Eigen::Matrix2d landmark_covariance(const FilterState& state, std::size_t i);

/// True if the vehicle's estimate is finite and no variance is negative or NaN. O(size).
bool is_sound(const FilterState& state);

/// Sets the covariance to the prior, with an exact pose, and removes all landmarks. The estimate
/// stays unchanged.
void set_prior(FilterState& state, const EkfPriorParameters& prior);

}  // namespace understory::ekf
