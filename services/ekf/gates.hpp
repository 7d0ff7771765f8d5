// The filter's limits of squared Mahalanobis distances.
#pragma once

#include <cstddef>
#include <vector>

#include "services/ekf/parameters.hpp"

namespace understory::ekf {

/// Most observations in one search for joint compatibility.
inline constexpr std::size_t kMaxSearched = 24;

/// Gates of a stationary vehicle. Their probability is 1 - 1e-6: a vehicle may be stationary for
/// hours, and chance must not be taken for motion.
struct StationaryGates {
  double velocity = 0.0;       ///< Estimated velocity against zero, 2 degrees of freedom.
  double common_motion = 0.0;  ///< Common motion of all landmarks, 3 degrees of freedom.
  double ground_marks = 0.0;   ///< Both marks on the ground, 4 degrees of freedom.
};

/// Quantiles of the chi-squared distribution, computed once.
struct Gates {
  /// For sets of up to `max_landmarks` landmarks.
  Gates(const EkfGateParameters& parameters, int max_landmarks);

  double landmark = 0.0;       ///< One landmark, 2 degrees of freedom.
  std::vector<double> set;     ///< All landmarks of a scan together; index = their number.
  std::vector<double> rejoin;  ///< Lost landmarks together; index = their number.
  StationaryGates stationary;
};

/// Limits for sets of 0 .. `max_landmarks` landmarks, two degrees of freedom each; that of the
/// empty set is 0.
std::vector<double> set_gates(double probability, int max_landmarks);

}  // namespace understory::ekf
