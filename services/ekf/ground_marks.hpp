// While the vehicle stands, the ground under it is a landmark.
#pragma once

#include <span>

#include "services/ekf/filter_state.hpp"
#include "services/ekf/landmark_update.hpp"
#include "services/ekf/low_rank.hpp"

namespace understory::ekf {

/// Marks in the state while the vehicle stands: one ahead of it, one behind.
inline constexpr int kGroundMarks = 2;

/// How far the body sways about the place where it is parked: the same at every moment, however
/// long it stands, unlike motion noise, which would add up.
struct Sway {
  double sigma_m = 0.0;    ///< Per axis.
  double sigma_rad = 0.0;  ///< > 0.
};

bool has_ground_marks(const FilterState& state);
/// Sets marks where the vehicle is. Precondition: none are set and there is room for them.
void add_ground_marks(FilterState& state, const Sway& sway);
void remove_ground_marks(FilterState& state);
/// The vehicle is still where the marks were set, but for its sway. Nothing changes, and false is
/// returned, where the squared Mahalanobis distance (4 degrees of freedom) is above `gate`: then it
/// has moved after all.
bool measure_ground_marks(FilterState& state, const Sway& sway, double gate, JointUpdate& joint,
                          LowRank& room);

/// Whether all sightings together are displaced: squared Mahalanobis distance (3 degrees of
/// freedom) of the one motion of the vehicle that fits their innovations best. Finds creeping long
/// before any single landmark does. At most kMaxRows / 2 pairings, of two landmarks at least.
double common_motion(const FilterState& state, std::span<const Observation> observations,
                     std::span<const Pairing> pairings);

}  // namespace understory::ekf
