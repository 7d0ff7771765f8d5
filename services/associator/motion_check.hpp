// Whether a track moves: pedestrians are no landmarks.
#pragma once

#include "services/associator/track_list.hpp"

namespace understory::associator {

/// Longest time [s] over which two observations are compared: errors of wheels accumulate.
constexpr double kMaxComparison_s = 1.5;

/// The vehicle's motion from a track's reference observation until now, by wheels and IMU alone. A
/// pose refined by the tracks would follow a pedestrian who is the only track in view.
struct MotionCheck {
  double seconds = 0.0;  ///< Between the two observations.
  geometry::SE2WithCovariance then_T_now;
};

/// Updates `track.steadiness` by a matched observation. Two successive contradictions (chi^2 of 2
/// degrees of freedom above 23, one in 100,000) mean that it moves. It is stationary once motion at
/// `walking_mps` would have been detected, or after kMaxComparison_s.
void check_motion(Track& track, const Observation& observation, const MotionCheck& check,
                  const AssociatorParameters& parameters);

}  // namespace understory::associator
