// Which landmarks of two maps are the same ones, if one map lies in the other as a motion says.
#pragma once

#include <vector>

#include "common/map_merge/alignment.hpp"
#include "common/map_merge/landmark_set.hpp"

namespace understory::map_merge {

/// The pairs of a motion, and what speaks for it.
struct Pairing {
  std::vector<LandmarkPair> pairs;  ///< One to one, by `second`; indices in LandmarkSet::all().
  std::size_t first_in_overlap = 0;
  std::size_t second_in_overlap = 0;
  std::size_t pairs_in_overlap = 0;
  /// log10 of a bound on the probability that chance gives so many pairs to one motion.
  double log10_tail = 0.0;

  /// Pairs over the landmarks in the overlap of the map that has fewer there.
  double share() const;
};

/// What the difference between two landmarks, one of each map, may be. The maps' own errors are in
/// part common to all their landmarks (the gauge, a drift): that part moves a map as a whole, and
/// once the motion is known it is in no difference.
struct DifferenceModel {
  geometry::SE2 first_T_second;
  /// Of the common motion, about `centre_m` of the second map (x, y, theta; right perturbation).
  Eigen::Matrix3d common = Eigen::Matrix3d::Zero();
  Eigen::Vector2d centre_m = Eigen::Vector2d::Zero();
  double least_m2 = 0.0;  ///< Smallest variance that is left for a landmark of its own.
  double scale = 1.0;     ///< Of what is left, where more differs than the maps state.

  /// As both maps state it, frame `first`.
  Eigen::Matrix2d stated(const UncertainLandmark& first, const UncertainLandmark& second) const;
  /// The part that is independent from landmark to landmark.
  Eigen::Matrix2d independent(const UncertainLandmark& first,
                              const UncertainLandmark& second) const;
  /// Derivative of a landmark's place, frame `first`, by the motion about the centre.
  Eigen::Matrix<double, 2, 3> jacobian(const UncertainLandmark& second) const;
};

/// The nearest landmarks of one kind within the gate, the best pairs first. The error of the motion
/// is not in the gate.
Pairing pair_up(const LandmarkSet& first, const LandmarkSet& second, const DifferenceModel& model,
                const AlignmentParameters& parameters);

}  // namespace understory::map_merge
