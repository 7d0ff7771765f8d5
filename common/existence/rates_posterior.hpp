// What v of this drive, v of the drives before and lambda can be, by histories.
#pragma once

#include <vector>

#include "common/existence/histories.hpp"

namespace understory::existence {

/// Points with one history.
struct AlikePoints {
  double points = 0.0;
  double missed_before = 0.0;
  double missed_now = 0.0;
  double since_s = 0.0;
  double until_missed_s = 0.0;
  bool is_seen_now = false;
  double rays = 1.0;  ///< OpenHistory's, with those of all sides.
  int sides = 0;      ///< Likewise.
  int hidden_before = 0;
};

/// All that the posterior is made of.
struct RateEvidence {
  double before_seen = 0.0, before_missed = 0.0;  ///< Beta counts of v before.
  double went = 0.0, exposure_s = 0.0;            ///< Gamma counts of lambda.
  RatePriors priors;
  double share =
      1.0;  ///< What passes before this drive count for; the counts above are so already.
  std::vector<AlikePoints> histories;
};

/// The posterior's means; see PassHistories. What is not learned stays as `until_now` has it.
LearnedRates posterior_means(const RateEvidence& evidence, const LearnedRates& until_now,
                             bool learns_recall, bool learns_decay);

}  // namespace understory::existence
