// Pairs the landmarks of two maps, given the relative motion.
#pragma once

#include <vector>

#include "common/map_merge/alignment.hpp"
#include "common/map_merge/landmark_set.hpp"

namespace understory::map_merge {

/// The pairs of a motion, and its bound on chance.
struct Pairing {
  std::vector<LandmarkPair> pairs;  ///< One to one, by `second`; indices in LandmarkSet::all().
  std::size_t first_in_overlap = 0;
  std::size_t second_in_overlap = 0;
  std::size_t pairs_in_overlap = 0;
  /// log10 of a bound on the probability of as many pairs by chance for one motion.
  double log10_tail = 0.0;

  /// Pairs / landmarks in the overlap, of the map with fewer there.
  double share() const;
};

/// Model of the difference between two landmarks, one of each map. Part of a map's errors is common
/// to all its landmarks (the gauge, a drift): it moves the whole map, and at a known motion no
/// difference contains it.
struct DifferenceModel {
  geometry::SE2 first_T_second;
  /// Covariance of the common motion, about `centre_m` of the second map (x, y, theta; right
  /// perturbation).
  Eigen::Matrix3d common = Eigen::Matrix3d::Zero();
  Eigen::Vector2d centre_m = Eigen::Vector2d::Zero();
  double least_m2 = 0.0;  ///< Least independent variance of a landmark.
  double scale = 1.0;     ///< Factor on the rest, where differences exceed the stated covariances.

  /// Covariance stated by both maps, frame `first`.
  Eigen::Matrix2d stated(const UncertainLandmark& first, const UncertainLandmark& second) const;
  /// The part that is independent from landmark to landmark.
  Eigen::Matrix2d independent(const UncertainLandmark& first,
                              const UncertainLandmark& second) const;
  /// Derivative of a landmark's position, frame `first`, by the motion about the centre.
  Eigen::Matrix<double, 2, 3> jacobian(const UncertainLandmark& second) const;
};

/// The nearest landmarks of one kind within the gate, the best pairs first. The gate does not
/// include the error of the motion.
Pairing pair_up(const LandmarkSet& first, const LandmarkSet& second, const DifferenceModel& model,
                const AlignmentParameters& parameters);

}  // namespace understory::map_merge
