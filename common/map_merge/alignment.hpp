// Finds whether two maps of landmarks overlap, and the relative pose of their frames.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/map.hpp"

namespace understory::map_merge {

/// Assumptions on two maps, and limits for accepting an overlap. Sigmas are standard deviations.
struct AlignmentParameters {
  double unknown_sigma_m = 0.1;  ///< Sigma of a landmark without covariance, per axis [m].
  /// Two landmarks may be the same within this many standard deviations.
  double gate_sigmas = 4.0;
  double gate_floor_m = 0.05;  ///< Additional error not in the covariances, per axis [m].
  double max_gate_m = 1.0;     ///< Landmarks farther apart are never the same [m].
  std::size_t min_pairs = 8;   ///< Least number of common landmarks.
  /// Least share of common landmarks among the landmarks in the overlap, of the map with fewer
  /// there: two visits of a forest share at least a third.
  double min_share = 0.2;
  /// An overlap is accepted only if the expected number of equally good motions by chance, over all
  /// hypotheses tried, is below this ...
  double max_log10_false_alarm = -9.0;
  /// ... and is larger by this many decades for the best different motion ...
  double min_log10_margin = 6.0;
  /// ... and by this share of the best one's decades: repeated structures exceed chance in many
  /// places.
  double min_margin_share = 0.5;
};

/// Result of the search for an overlap.
enum class AlignmentOutcome : std::uint8_t {
  kAligned = 0,
  kTooFewLandmarks = 1,  ///< A map has fewer than `min_pairs`.
  kNoOverlap = 2,        ///< No part of one was found in the other.
  kLikelyChance = 3,     ///< Not sure: chance may give as many pairs.
  kFewInCommon = 4,      ///< Not sure: too few landmarks of the overlap are in both maps.
  kAmbiguous = 5,        ///< Not sure: a different motion fits nearly as well.
};
/// One line of text.
std::string_view describe(AlignmentOutcome outcome);

/// A landmark of both maps.
struct LandmarkPair {
  std::uint32_t first = 0;   ///< Index in the first map's landmarks.
  std::uint32_t second = 0;  ///< Index in the second map's landmarks.
  double distance_m = 0.0;   ///< Distance between the two after the motion.
  double chi2 = 0.0;  ///< Squared Mahalanobis distance by both covariances, two degrees of freedom.
  /// Share of both stated variances that is independent for this pair, 0 to 1. The rest is common
  /// to all landmarks of a map: it moves the whole map.
  double independent_share = 1.0;
};

/// Relative pose of two maps. All but `outcome` belongs to the best motion found, also where it was
/// not accepted.
struct Alignment {
  AlignmentOutcome outcome = AlignmentOutcome::kNoOverlap;
  geometry::SE2 first_T_second;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Right perturbation; m, rad.
  std::vector<LandmarkPair> pairs;                       ///< One to one, by `second`.
  std::size_t first_in_overlap = 0;   ///< Landmarks of the first map in the area of the second.
  std::size_t second_in_overlap = 0;  ///< Landmarks of the second map in the area of the first.
  std::size_t pairs_in_overlap = 0;
  /// log10 of an upper bound on the expected number of equally good motions by chance.
  double log10_false_alarm = 0.0;
  double log10_margin = 0.0;   ///< Decades to the best different motion.
  std::size_t windows = 0;     ///< Parts of the smaller map that were searched.
  std::size_t hypotheses = 0;  ///< Motions tried.

  /// True where an overlap was accepted.
  bool found() const { return outcome == AlignmentOutcome::kAligned; }
  /// Pairs / landmarks in the overlap, of the map with fewer there; 0 to 1.
  double share() const;
  /// The reason with its numbers; one line.
  std::string reason(const AlignmentParameters& parameters) const;
};

/// Looks for the overlap with no prior. Windows of the smaller map are searched in the larger one
/// (common/constellation), small windows first; each resulting motion is verified and refined on
/// all landmarks of the overlap, with both maps' covariances. Values that are not finite are left
/// out. The same maps give the same result. Cost: about linear in the landmarks of the smaller map;
/// 12 s where two maps of 10,000 have a tenth in common, 31 s where they have nothing.
///
/// In the covariance, the residuals of the pairs are independent from landmark to landmark, and the
/// rest of the stated covariances is a rigid motion common to all landmarks of a map.
///
/// `progress` is called repeatedly with the fraction done, 0 to 1; an exception of it ends the
/// search.
Alignment align(
    std::span<const model::MapLandmark> first, std::span<const model::MapLandmark> second,
    const AlignmentParameters& parameters = {},
    const std::function<void(double)>& progress = [](double /*part*/) {});

/// Limits with a stated relative pose: 5 pairs, and 4 decades instead of 9 against chance and
/// instead of 6 to a different motion (a guess is evidence too; compare docs/decisions/093).
AlignmentParameters with_guess(AlignmentParameters parameters);

/// Like align() with a stated first_T_second and its covariance (right perturbation). Only motions
/// within four standard deviations of it are accepted, by with_guess(parameters). The same cost.
Alignment align_near(const geometry::SE2WithCovariance& guess,
                     std::span<const model::MapLandmark> first,
                     std::span<const model::MapLandmark> second,
                     const AlignmentParameters& parameters = {});

}  // namespace understory::map_merge
