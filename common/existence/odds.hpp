// Probabilities as odds o = p / (1 - p).
#pragma once

#include <algorithm>
#include <cmath>

namespace understory::existence {

/// Bayes' rule on odds is one multiplication by the likelihood ratio: it replaces the sum of
/// log-odds, without a logarithm. As precise near 0 as near 1.
inline double odds_of(double probability) { return probability / (1.0 - probability); }

/// The probability of finite odds.
inline double probability_of(double odds) { return odds / (1.0 + odds); }

/// Bounds of P(exists): 1e-6 and 1 - 1e-6, as odds.
inline constexpr double kLeastOdds = 1e-6 / (1.0 - 1e-6);
inline constexpr double kMostOdds = (1.0 - 1e-6) / 1e-6;
/// Largest odds within a pass: its hits outweigh occlusion from ten directions of the same pass.
/// The next pass starts at most at kMostOdds.
inline constexpr double kMostOddsInPass = 1e12;

/// P <- P exp(-rate dt) on odds; `lost` = 1 - exp(-rate dt). Exact also where `lost` is 1e-15.
inline double survived(double odds, double lost) {
  return odds * (1.0 - lost) / (1.0 + odds * lost);
}

/// p <- p + (rest - p) moved on odds; `moved` = 1 - exp(-rate dt).
inline double relaxed(double odds, double rest, double moved) {
  const double probability = probability_of(odds);
  return odds_of(probability + (rest - probability) * moved);
}

/// 1 - exp(-rate dt), exact for small products.
inline double lost_share(double rate_per_s, double dt_s) { return -std::expm1(-rate_per_s * dt_s); }

}  // namespace understory::existence
