// Whether a track stands: what walks is no landmark.
#pragma once

#include "services/associator/track_list.hpp"

namespace understory::associator {

/// Sightings are compared with one at most so old [s]: wheels forget.
constexpr double kCompared_s = 1.5;

/// What a track's sighting is compared with: the one that it began with, or one a while ago. The
/// vehicle's own motion between the two is by wheels and IMU alone: a pose refined by the tracks
/// would follow somebody who is the only one in view.
struct MotionCheck {
  double seconds = 0.0;  ///< Between the two sightings.
  geometry::SE2WithCovariance then_T_now;
};

/// Updates `track.steadiness` by a sighting that it was matched with.
void check_motion(Track& track, const Seen& seen, const MotionCheck& check,
                  const AssociatorParameters& parameters);

}  // namespace understory::associator
