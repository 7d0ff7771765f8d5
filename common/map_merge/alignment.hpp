// Whether two maps of landmarks overlap, and how the frame of one lies in that of the other.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/map.hpp"

namespace understory::map_merge {

/// What is assumed of two maps, and when they are taken to overlap. Sigmas are standard deviations.
struct AlignmentParameters {
  double unknown_sigma_m = 0.1;  ///< Of a landmark without covariance, per axis [m].
  double gate_sigmas = 4.0;      ///< Two landmarks may be one within so many standard deviations.
  double gate_floor_m = 0.05;    ///< Standard error that no covariance has, per axis [m].
  double max_gate_m = 1.0;       ///< Two landmarks farther apart are never one [m].
  std::size_t min_pairs = 8;     ///< Fewest landmarks that both maps have.
  /// Smallest share of the landmarks in the overlap, of the map that has fewer there, that both
  /// maps have: two visits of a forest share a third at worst.
  double min_share = 0.2;
  /// Overlap only if chance gives so many pairs less often than this, in all hypotheses tried ...
  double max_log10_false_alarm = -9.0;
  /// ... and if the best different motion is so many decades more likely to be chance ...
  double min_log10_margin = 6.0;
  /// ... and this share of the decades of the best one: what repeats itself shows more than chance
  /// in many places.
  double min_margin_share = 0.5;
};

/// Why two maps are taken to overlap, or not.
enum class AlignmentOutcome : std::uint8_t {
  kAligned = 0,
  kTooFewLandmarks = 1,  ///< A map has fewer than `min_pairs`.
  kNoOverlap = 2,        ///< No part of one is found in the other.
  kLikelyChance = 3,     ///< Not sure: chance gives as many pairs.
  kFewInCommon = 4,      ///< Not sure: of the landmarks in the overlap too few are in both maps.
  kAmbiguous = 5,        ///< Not sure: a different motion fits nearly as well.
};
/// One line for a person.
std::string_view describe(AlignmentOutcome outcome);

/// A landmark that both maps have.
struct LandmarkPair {
  std::uint32_t first = 0;   ///< Index in the first map's landmarks.
  std::uint32_t second = 0;  ///< Index in the second map's landmarks.
  double distance_m = 0.0;   ///< What the motion leaves between the two.
  double chi2 = 0.0;         ///< The same by both covariances, two degrees of freedom.
  /// Share of both stated variances that is this pair's own, 0 to 1. The rest is common to all
  /// landmarks of a map: it moves the map as a whole.
  double independent_share = 1.0;
};

/// How two maps lie to each other. But for `outcome` it is of the best motion found, also where
/// that was not accepted.
struct Alignment {
  AlignmentOutcome outcome = AlignmentOutcome::kNoOverlap;
  geometry::SE2 first_T_second;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Right perturbation; m, rad.
  std::vector<LandmarkPair> pairs;                       ///< One to one, by `second`.
  std::size_t first_in_overlap = 0;   ///< Landmarks of the first map where the second has some.
  std::size_t second_in_overlap = 0;  ///< And the other way round.
  std::size_t pairs_in_overlap = 0;
  /// log10 of an upper bound on the expected number of so good motions by chance.
  double log10_false_alarm = 0.0;
  double log10_margin = 0.0;   ///< Decades to the best different motion.
  std::size_t windows = 0;     ///< Parts of the smaller map that were searched.
  std::size_t hypotheses = 0;  ///< Motions tried.

  /// True where the maps overlap for certain.
  bool found() const { return outcome == AlignmentOutcome::kAligned; }
  /// Pairs over the landmarks in the overlap of the map that has fewer there; 0 to 1.
  double share() const;
  /// Why, with the numbers; one line.
  std::string reason(const AlignmentParameters& parameters) const;
};

/// Looks for the overlap with no prior. Windows of the smaller map are searched in the larger one
/// (common/constellation), small windows first; each motion that comes of one is verified and
/// refined on all landmarks of the overlap, with both maps' covariances. What is not finite is left
/// out. The same maps give the same result. Cost: about linear in the landmarks of the smaller map;
/// 12 s where two maps of 10,000 have a tenth in common, 31 s where they have nothing.
///
/// The covariance takes what the pairs leave as independent from landmark to landmark, and the rest
/// of the stated covariances as a rigid motion that is common to all landmarks of a map.
///
/// `progress` is called now and then with the part of the search that is done, 0 to 1; what it
/// throws ends the search.
Alignment align(
    std::span<const model::MapLandmark> first, std::span<const model::MapLandmark> second,
    const AlignmentParameters& parameters = {},
    const std::function<void(double)>& progress = [](double /*part*/) {});

/// What is asked of landmarks where somebody says how the maps lie: 5 pairs, and 4 decades instead
/// of 9 against chance and of 6 to a different motion (a guess is evidence, too; compare
/// docs/decisions/093).
AlignmentParameters with_guess(AlignmentParameters parameters);

/// Likewise where somebody says it: first_T_second with its covariance (right perturbation). Only
/// motions within four standard deviations of it count, by with_guess(parameters). The same cost.
Alignment align_near(const geometry::SE2WithCovariance& guess,
                     std::span<const model::MapLandmark> first,
                     std::span<const model::MapLandmark> second,
                     const AlignmentParameters& parameters = {});

}  // namespace understory::map_merge
