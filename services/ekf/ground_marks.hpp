// While the vehicle is stationary, the ground under it is a landmark.
#pragma once

#include <span>

#include "services/ekf/filter_state.hpp"
#include "services/ekf/landmark_update.hpp"
#include "services/ekf/low_rank.hpp"

namespace understory::ekf {

/// Marks in the state while the vehicle is stationary: one ahead of it, one behind.
inline constexpr int kGroundMarks = 2;

/// Standard deviation of the body's sway (engine, wind) about the place where it is parked. It does
/// not grow with time, unlike motion noise.
struct Sway {
  double sigma_m = 0.0;    ///< Per axis.
  double sigma_rad = 0.0;  ///< Of the heading; > 0.
};

/// True while the state has marks. O(landmarks).
bool has_ground_marks(const FilterState& state);
/// Sets marks where the vehicle is. Precondition: none are set and there is room for them.
void add_ground_marks(FilterState& state, const Sway& sway);
/// Removes the marks, if there are any.
void remove_ground_marks(FilterState& state);
/// Measures that the vehicle is where the marks were set, with the noise of its sway. Returns
/// false, and changes nothing, where the squared Mahalanobis distance (4 degrees of freedom) is
/// above `gate`: the vehicle has moved. Precondition: the marks are set.
bool measure_ground_marks(FilterState& state, const Sway& sway, double gate, JointUpdate& joint,
                          LowRank& low_rank);

/// Squared Mahalanobis distance (3 degrees of freedom) of the one motion of the vehicle that fits
/// the innovations of all pairings best. Finds creeping long before any single landmark does.
/// Precondition: 2 to kMaxRows / 2 pairings, of two landmarks at least.
double common_motion(const FilterState& state, std::span<const Observation> observations,
                     std::span<const Pairing> pairings);

}  // namespace understory::ekf
