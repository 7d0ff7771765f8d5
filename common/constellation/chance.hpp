// Probability that chance alone produces a number of hits.
#pragma once

#include <cmath>

namespace understory::constellation {

/// log10 of an upper bound (Chernoff) on the probability of at least `hits` successes in `tries`
/// independent tries of mean probability `chance`; tries may differ in probability (Hoeffding
/// 1956). 0 where the bound is trivial
/// (no more hits than the mean).
inline double log10_binomial_tail_bound(double hits, double tries, double chance) {
  if (tries <= 0.0 || hits <= chance * tries || chance >= 1.0) return 0.0;
  if (chance <= 0.0) return -1e3;
  const double share = std::min(hits / tries, 1.0);
  double divergence = share * std::log(share / chance);
  if (share < 1.0) divergence += (1.0 - share) * std::log((1.0 - share) / (1.0 - chance));
  return -tries * divergence / std::log(10.0);
}

}  // namespace understory::constellation
