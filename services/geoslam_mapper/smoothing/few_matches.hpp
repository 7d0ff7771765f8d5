// Whether a few matches add information to a pose by odometry.
#pragma once

#include <span>

#include "common/geometry/registration.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A scan registered to landmarks around a guess by odometry.
struct MatchedScan {
  std::span<const geometry::UncertainPoint> reference;  ///< Frame `map`.
  std::span<const geometry::UncertainPoint> observed;   ///< Frame of the vehicle.
  geometry::SE2WithCovariance guess;                    ///< map_T_vehicle before the matches.
  geometry::Registration found;                         ///< Result of the matches.
};

/// Number of unambiguous pairs; the pose rests on these.
std::size_t count_clear(std::span<const geometry::PointPair> pairs);

/// Whether the unambiguous pairs add information to odometry: one true match does, a chance match
/// does not. Two tests: the pairs and the guess must agree (chi^2 of their errors, each by its
/// covariance; limit: one scan in 1000), and this number of pairs must be unlikely by chance at the
/// gates' size and the landmarks' density (one scan in 100). `reach_m`: radius around the guess
/// within which `reference` was collected.
bool adds_to_odometry(const MatchedScan& scan, const geometry::RegistrationParameters& gating,
                      double reach_m);

}  // namespace understory::geoslam_mapper::smoothing
