// What became of the points since each was last surely seen, and the rates that it speaks for.
#pragma once

#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "common/existence/decay_rate.hpp"

namespace understory::existence {

/// Passes of one point since the last that surely saw it, up to now.
struct OpenHistory {
  double missed = 0.0;        ///< Passes that looked for it and missed it.
  float since_s = 0.0F;       ///< From the last sure sighting to the last pass that looked.
  bool is_closed = false;     ///< The pass that is open surely sees it: it never went.
  double counted_seen = 0.0;  ///< What of it DetectorRecall has counted already, by P of then,
  double counted_missed = 0.0;
  DecayEvidence counted{};  ///< and DecayRate.
};

/// Hits and misses of passes, points that went and their exposure [point s]: with the priors.
struct PassCounts {
  double seen = 0.0;
  double missed = 0.0;
  double went = 0.0;
  double exposure_s = 0.0;
};

/// v and lambda: means of their posterior.
struct LearnedRates {
  double pass_recall = 0.0;
  double decay_per_s = 0.0;
};

/// Capture-recapture with two unknowns (Cormack, Biometrika 51, 1964): passes see a point that is
/// there with v, and points go at the rate lambda. A point that was missed m times and seen again
/// after the time T speaks with exp(-lambda T) v (1 - v)^m, one that is missing still with
///
///     1 - exp(-lambda T) + exp(-lambda T) (1 - v)^m
///
/// (who goes does so before the first of the misses). One pass after years fixes the product of v
/// and exp(-lambda T) alone, and the priors the rest: steps of EM along such a ridge end somewhere
/// on it. Here the posterior is summed up over a grid, so that all of it counts.
class PassHistories {
 public:
  void add(const OpenHistory& history);
  std::size_t missing() const { return missing_; }

  /// `counted`: of all histories, those above as they were counted, and of the priors. An unknown
  /// that is not learned stays at `before`.
  LearnedRates rates(const PassCounts& counted, const LearnedRates& before, bool learns_recall,
                     bool learns_decay) const;

 private:
  /// Histories that are alike: sums.
  struct Alike {
    double points = 0.0;
    double missed = 0.0;
    double since_s = 0.0;
  };

  std::map<std::pair<int, int>, Alike> open_;  ///< By misses and the logarithm of the time.
  PassCounts closed_;                          ///< In place of what was counted.
  std::size_t missing_ = 0;
};

}  // namespace understory::existence
