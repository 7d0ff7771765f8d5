// Posterior of v of this drive, v of the drives before, and lambda, from histories.
#pragma once

#include <vector>

#include "common/existence/histories.hpp"

namespace understory::existence {

/// Points with the same history.
struct AlikePoints {
  double points = 0.0;
  double missed_before = 0.0;
  double missed_now = 0.0;
  double since_s = 0.0;
  double until_missed_s = 0.0;
  bool is_seen_now = false;
  double rays = 1.0;  ///< OpenHistory::rays, including the factor of all passed sides.
  int sides = 0;      ///< As in OpenHistory.
  int hidden_before = 0;
};

/// Input of the posterior.
struct RateEvidence {
  double before_seen = 0.0, before_missed = 0.0;  ///< Beta counts of v before.
  double went = 0.0, exposure_s = 0.0;            ///< Gamma counts of lambda.
  RatePriors priors;
  double share = 1.0;  ///< Weight of passes before this drive; the counts above include it already.
  std::vector<AlikePoints> histories;
};

/// The posterior's means; see PassHistories. Rates that are not learned stay as in `until_now`.
LearnedRates posterior_means(const RateEvidence& evidence, const LearnedRates& until_now,
                             bool learns_recall, bool learns_decay);

}  // namespace understory::existence
