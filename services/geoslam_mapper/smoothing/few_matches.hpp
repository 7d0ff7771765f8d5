// What few matches are worth where odometry says where the scan was made.
#pragma once

#include <span>

#include "common/geometry/registration.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A scan that was registered to landmarks around a guess by odometry.
struct MatchedScan {
  std::span<const geometry::UncertainPoint> reference;  ///< Frame `map`.
  std::span<const geometry::UncertainPoint> observed;   ///< Frame of the vehicle.
  geometry::SE2WithCovariance guess;                    ///< map_T_vehicle before the matches.
  geometry::Registration found;                         ///< With them.
};

/// Pairs of which neither end may be another point: those that the pose rests on.
std::size_t count_clear(std::span<const geometry::PointPair> pairs);

/// Whether the clear pairs add to what odometry says. One landmark is information; a pair by chance
/// is not. So the pairs and the guess must agree with each other (chi^2 of their errors, each by
/// its covariance, beyond which one scan in 1000 is), and so many pairs must not be expected in
/// gates so wide among landmarks so dense (one scan in 100). `reach_m`: how far around the guess
/// `reference` was collected.
bool adds_to_odometry(const MatchedScan& scan, const geometry::RegistrationParameters& gating,
                      double reach_m);

}  // namespace understory::geoslam_mapper::smoothing
