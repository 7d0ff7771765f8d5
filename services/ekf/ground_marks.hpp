// Marks on the ground: landmarks under a stationary vehicle.
#pragma once

#include <span>

#include "services/ekf/filter_state.hpp"
#include "services/ekf/landmark_update.hpp"
#include "services/ekf/low_rank.hpp"

namespace understory::ekf {

/// Marks in the state while the vehicle is stationary: one ahead of it, one behind.
inline constexpr int kGroundMarks = 2;

/// Standard deviation of the body's sway (engine, wind) about its parking position. It does not
/// grow with time, unlike motion noise.
struct Sway {
  double sigma_m = 0.0;    ///< Per axis.
  double sigma_rad = 0.0;  ///< Of the heading; > 0.
};

/// True while the state has marks. O(landmarks).
bool has_ground_marks(const FilterState& state);
/// Sets marks at the vehicle. Precondition: none are set and there is room for them.
void add_ground_marks(FilterState& state, const Sway& sway);
/// Removes the marks, if there are any.
void remove_ground_marks(FilterState& state);
/// Measures that the vehicle is still at its marks, with the noise of its sway. Returns false
/// without change if the squared Mahalanobis distance (4 degrees of freedom) is above `gate`: the
/// vehicle has moved. Precondition: the marks are set.
bool measure_ground_marks(FilterState& state, const Sway& sway, double gate, JointUpdate& joint,
                          LowRank& low_rank);

/// Squared Mahalanobis distance (3 degrees of freedom) of the motion of the vehicle that fits the
/// innovations of all pairings best. Detects creeping long before any single landmark does.
/// Precondition: 2 to kMaxRows / 2 pairings, of two landmarks at least.
double common_motion(const FilterState& state, std::span<const Observation> observations,
                     std::span<const Pairing> pairings);

}  // namespace understory::ekf
