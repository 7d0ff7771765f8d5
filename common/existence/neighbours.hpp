// Evidence shared by neighbours: changes and occlusions affect patches of points.
#pragma once

#include <array>
#include <cstdint>

namespace understory::existence {

/// Probabilities of common changes of a patch between two passes.
struct PatchParameters {
  double cleared = 0.02;     ///< Probability that the patch was cleared (clear-cut, removed row).
  double gone_in_it = 0.97;  ///< Share of removed points in a cleared patch.
  double occluded = 0.05;    ///< Probability that the patch is hidden from one direction.
  double also_from = 0.2;    ///< Probability for each further direction, if it is hidden from one.
};

/// A point of a patch: its contribution, which later evidence replaces.
struct PatchMember {
  double before = 0.5;   ///< P of the point before the looks of this pass.
  double alone = 0.5;    ///< The same, given that the patch has no common change.
  double kept = 0.5;     ///< The same, given that the patch was cleared.
  double ratio = 1.0;    ///< Likelihood ratio of its looks: odds now / odds before.
  double cleared = 0.0;  ///< Its log likelihood ratios of "cleared" and "occluded" to "neither".
  double occluded = 0.0;
};

/// Points close together in one pass, with three common hypotheses: no change, cleared, occluded
/// from every direction with a miss. Given the hypothesis the points are independent, so the
/// posterior is exact with two sums for the patch, at constant cost per update and query. Make a
/// new patch for each pass.
class Patch {
 public:
  /// Throws std::invalid_argument where a parameter is not in (0, 1).
  explicit Patch(const PatchParameters& parameters = {});

  /// Adds a point with its odds before the pass.
  PatchMember join(double odds_before) const;

  /// Updates a member: `odds` by its own looks alone; `missed_from`: its sectors with misses.
  void update(PatchMember& member, double odds, std::uint32_t missed_from);

  /// P of a member from its own looks and those of all others.
  double probability(const PatchMember& member) const;
  /// Posterior that the patch was cleared.
  double cleared() const;

 private:
  std::array<double, 3> log_weights(double cleared, double occluded) const;

  PatchParameters parameters_;
  double sum_cleared_ = 0.0;
  double sum_occluded_ = 0.0;
  std::uint32_t missed_from_ = 0;
};

}  // namespace understory::existence
