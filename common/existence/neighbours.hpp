// Evidence that neighbours share: the world changes in patches, and occluders hide patches.
#pragma once

#include <array>
#include <cstdint>

namespace understory::existence {

/// What may have come over a patch between two passes.
struct PatchParameters {
  double cleared = 0.02;     ///< Probability that the patch was cleared (clear-cut, row that left).
  double gone_in_it = 0.97;  ///< Share of a cleared patch's points that went.
  double occluded = 0.05;    ///< Probability that something hides the patch from one direction.
  double also_from = 0.2;    ///< The same for each further direction, if it does from one.
};

/// A patch's point: what the patch must forget of it when more is known.
struct PatchMember {
  double before = 0.5;   ///< P of the point before the looks of this pass,
  double alone = 0.5;    ///< if nothing common came over the patch,
  double kept = 0.5;     ///< and if it was cleared.
  double ratio = 1.0;    ///< Likelihood ratio of its looks: odds now / odds before.
  double cleared = 0.0;  ///< Its log likelihood ratios of "cleared" and "occluded" to "neither".
  double occluded = 0.0;
};

/// Points close together in one pass, with three hypotheses about all of them: nothing common,
/// cleared, occluded from every direction that missed. Given the hypothesis the points are
/// independent, so the posterior is exact with two sums for the patch: constant cost per update and
/// per answer. Begin anew with each pass.
class Patch {
 public:
  /// Throws std::invalid_argument where a parameter is not in (0, 1).
  explicit Patch(const PatchParameters& parameters = {});

  /// A point joins with its odds before the pass.
  PatchMember join(double odds_before) const;

  /// A member's odds by its own looks alone are now `odds`; `missed_from`: its sectors with misses.
  void update(PatchMember& member, double odds, std::uint32_t missed_from);

  /// P of a member: from its own looks and those of all others.
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
