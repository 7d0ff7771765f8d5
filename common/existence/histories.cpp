#include "common/existence/histories.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/existence/odds.hpp"

namespace understory::existence {
namespace {

/// Histories are alike to a quarter of a pass and a tenth of the time. So many misses say all.
constexpr double kPerPass = 4.0;
constexpr double kPerFactor = 7.0;
constexpr double kMostMissed = 32.0;
constexpr double kLeastCounted = 1e-3;

constexpr std::size_t kSteps = 24;
/// The grid closes in on the posterior so often: from all that can be to this many sigmas.
constexpr int kZooms = 4;
constexpr double kSigmas = 4.0;

/// One axis of the grid: log-odds of v or the logarithm of lambda.
struct Axis {
  double from = 0.0;
  double to = 0.0;
  double at(std::size_t step) const {
    return from + (to - from) * (static_cast<double>(step) + 0.5) / static_cast<double>(kSteps);
  }
  std::size_t steps() const { return to > from ? kSteps : 1; }
};

/// Sums of weights along an axis.
struct Moments {
  double sum = 0.0;
  double squares = 0.0;
  void add(double weight, double value) {
    sum += weight * value;
    squares += weight * value * value;
  }
};

Axis closer(const Axis& axis, const Moments& moments, double total) {
  if (axis.steps() == 1) return axis;
  const double mean = moments.sum / total;
  const double sigma = std::sqrt(std::max(0.0, moments.squares / total - mean * mean));
  const double cell = (axis.to - axis.from) / static_cast<double>(kSteps);
  const double half = std::max(kSigmas * sigma, 1.5 * cell);
  return {std::max(axis.from, mean - half), std::min(axis.to, mean + half)};
}

double log_odds(double hits, double misses) { return std::log(hits / misses); }

struct Missing {
  double points = 0.0;
  double missed = 0.0;
  double since_s = 0.0;
};

/// The posterior, up to a factor.
class Posterior {
 public:
  Posterior(const PassCounts& counts, std::vector<Missing> missing)
      : counts_(counts), missing_(std::move(missing)) {}

  /// From the fewest to the most that may have been missed.
  Axis recall_axis() const {
    double passes = 0.0;
    for (const Missing& one : missing_) passes += one.points * one.missed;
    const double margin =
        kSigmas * (1.0 / std::sqrt(counts_.seen) + 1.0 / std::sqrt(counts_.missed));
    return {log_odds(counts_.seen, counts_.missed + passes) - margin,
            log_odds(counts_.seen, counts_.missed) + margin};
  }
  /// From none of the missing to all of them.
  Axis decay_axis() const {
    double points = 0.0, exposure_s = 0.0;
    for (const Missing& one : missing_) {
      points += one.points;
      exposure_s += one.points * one.since_s;
    }
    const double margin = kSigmas / std::sqrt(std::min(16.0, counts_.went));
    return {std::log(counts_.went / (counts_.exposure_s + exposure_s)) - margin,
            std::log((counts_.went + points) / counts_.exposure_s) + margin};
  }

  /// Means of v and lambda over a grid; the axes close in.
  LearnedRates sum_up(Axis& recall, Axis& decay) const {
    std::array<std::array<double, kSteps>, kSteps> logs{};
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < recall.steps(); ++i) {
      for (std::size_t k = 0; k < decay.steps(); ++k) {
        logs[i][k] = log_density(recall.at(i), decay.at(k));
        most = std::max(most, logs[i][k]);
      }
    }

    double total = 0.0;
    Moments of_recall, of_decay;
    LearnedRates rates;
    for (std::size_t i = 0; i < recall.steps(); ++i) {
      for (std::size_t k = 0; k < decay.steps(); ++k) {
        const double weight = std::exp(logs[i][k] - most);
        total += weight;
        of_recall.add(weight, recall.at(i));
        of_decay.add(weight, decay.at(k));
        rates.pass_recall += weight * probability_of(std::exp(recall.at(i)));
        rates.decay_per_s += weight * std::exp(decay.at(k));
      }
    }
    recall = closer(recall, of_recall, total);
    decay = closer(decay, of_decay, total);
    return {rates.pass_recall / total, rates.decay_per_s / total};
  }

 private:
  /// Beta and Gamma over log-odds and logarithm, times what the missing ones say.
  double log_density(double recall_log_odds, double log_decay) const {
    const double log_miss = -std::log1p(std::exp(recall_log_odds));
    const double rate = std::exp(log_decay);
    double sum = counts_.seen * (log_miss + recall_log_odds) + counts_.missed * log_miss +
                 counts_.went * log_decay - counts_.exposure_s * rate;
    for (const Missing& one : missing_) {
      const double lost = lost_share(rate, one.since_s);
      const double chance = lost + (1.0 - lost) * std::exp(one.missed * log_miss);
      sum += one.points * std::log(std::max(std::numeric_limits<double>::min(), chance));
    }
    return sum;
  }

  PassCounts counts_;
  std::vector<Missing> missing_;
};

}  // namespace

void PassHistories::add(const OpenHistory& history) {
  closed_.seen -= history.counted_seen;
  closed_.missed -= history.counted_missed;
  const auto went = static_cast<double>(history.counted.went);
  closed_.went -= went;
  closed_.exposure_s -= (1.0 - went) * static_cast<double>(history.counted.since_s);
  if (history.is_closed) {
    closed_.seen += 1.0;
    closed_.missed += history.missed;
    closed_.exposure_s += static_cast<double>(history.since_s);
    return;
  }
  const double missed = std::min(history.missed, kMostMissed);
  const double alike = std::round(kPerPass * missed);
  if (alike < 1.0) return;

  const double time = std::log(1.0 + static_cast<double>(history.since_s));
  Alike& sums = open_[{static_cast<int>(alike), static_cast<int>(std::round(kPerFactor * time))}];
  sums.points += 1.0;
  sums.missed += missed;
  sums.since_s += static_cast<double>(history.since_s);
  ++missing_;
}

LearnedRates PassHistories::rates(const PassCounts& counted, const LearnedRates& before,
                                  bool learns_recall, bool learns_decay) const {
  const PassCounts counts{std::max(kLeastCounted, counted.seen + closed_.seen),
                          std::max(kLeastCounted, counted.missed + closed_.missed),
                          std::max(kLeastCounted, counted.went + closed_.went),
                          std::max(kLeastCounted, counted.exposure_s + closed_.exposure_s)};
  std::vector<Missing> missing;
  missing.reserve(open_.size());
  for (const auto& [key, sums] : open_)
    missing.push_back({sums.points, sums.missed / sums.points, sums.since_s / sums.points});
  const Posterior posterior(counts, std::move(missing));

  const double recall = log_odds(before.pass_recall, 1.0 - before.pass_recall);
  const double decay = std::log(std::max(1e-300, before.decay_per_s));
  Axis over_recall = learns_recall ? posterior.recall_axis() : Axis{recall, recall};
  Axis over_decay = learns_decay ? posterior.decay_axis() : Axis{decay, decay};
  LearnedRates rates;
  for (int zoom = 0; zoom < kZooms; ++zoom) rates = posterior.sum_up(over_recall, over_decay);
  return {learns_recall ? rates.pass_recall : before.pass_recall,
          learns_decay ? rates.decay_per_s : before.decay_per_s};
}

}  // namespace understory::existence
