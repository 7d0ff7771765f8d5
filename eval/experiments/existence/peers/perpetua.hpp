// Perpetua (Saavedra-Ruiz et al.: "Perpetua: Multi-Hypothesis Persistence Modeling for Semi-Static
// Environments", IROS 2025, arXiv 2507.18808): mixtures of persistence and emergence filters in
// turns.
#pragma once

#include <vector>

#include "eval/experiments/existence/peers/persistence_filter.hpp"

namespace understory::eval::experiments::existence::peers {

/// A mixture of exponentials.
struct RateMixture {
  std::vector<double> rates_per_s;
  std::vector<double> weights;  ///< Sum 1.
};

/// Log likelihoods of all that a drive saw of a feature, if it is there and if it is gone.
struct SightingsOfDrive {
  double time_s = 0.0;
  double log_if_there = 0.0;
  double log_if_gone = 0.0;
};

/// One step of EM over features' histories (section IV-C): expected survival times and components.
RateMixture em_step(const RateMixture& mixture,
                    const std::vector<std::vector<SightingsOfDrive>>& features);

/// A mixture of persistence filters; as an emergence filter with the outputs' meaning exchanged.
class FilterMixture {
 public:
  FilterMixture(const RateMixture& mixture, double begin_s, bool is_emergence);
  void update(double time_s, bool is_seen, double missed, double false_rate);
  /// The likeliest component's p(X_t = 1).
  double predict(double time_s) const;
  /// Posterior weights of the components, with a share of the prior's: those of the next turn.
  std::vector<double> next_weights(const std::vector<double>& prior, double share) const;

 private:
  std::vector<double> posterior() const;

  std::vector<PersistenceFilter> filters_;
  std::vector<double> weights_;
  bool is_emergence_;
};

/// One feature. It persists until its belief is at most `low`, then it is expected to emerge, until
/// the belief is at least `high` (section IV-B).
class Perpetua {
 public:
  Perpetua(const RateMixture& persistence, const RateMixture& emergence, double begin_s);
  void update(double time_s, bool is_seen, double missed, double false_rate);
  double predict(double time_s) const;

 private:
  static constexpr double kLow = 0.05;
  static constexpr double kHigh = 0.95;
  static constexpr double kPriorShare = 0.1;

  RateMixture persistence_;
  RateMixture emergence_;
  FilterMixture persisting_;
  FilterMixture emerging_;
  bool is_persisting_ = true;
};

}  // namespace understory::eval::experiments::existence::peers
