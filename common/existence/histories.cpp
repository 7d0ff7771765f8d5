#include "common/existence/histories.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "common/existence/odds.hpp"

namespace understory::existence {
namespace {

/// Histories are alike to a quarter of a pass and an eighth of the time. So many misses say all.
constexpr double kPerPass = 4.0;
constexpr double kPerFactor = 8.0;
constexpr double kMostMissed = 16.0;
/// Parts of a pass, of a second and of a point that went, in which histories are counted.
constexpr double kPassParts = 1024.0;
constexpr double kSecondParts = 16.0;
constexpr double kWentParts = 1 << 24;
constexpr double kLeastOf = 1e-3;
constexpr double kTiny = std::numeric_limits<double>::min();

constexpr std::size_t kSteps = 12;
/// The grid closes in on the posterior so often: from all that can be to this many sigmas.
constexpr int kZooms = 5;
constexpr double kSigmas = 4.0;

/// One axis of the grid: log-odds of a v or the logarithm of lambda.
struct Axis {
  double from = 0.0;
  double to = 0.0;
  double at(std::size_t step) const {
    return from + (to - from) * (static_cast<double>(step) + 0.5) / static_cast<double>(kSteps);
  }
  std::size_t steps() const { return to > from ? kSteps : 1; }
};
using Axes = std::array<Axis, 3>;  ///< now, before, lambda.

/// Points with one history.
struct History {
  double points = 0.0;
  double missed_before = 0.0;
  double missed_now = 0.0;
  double since_s = 0.0;
  bool is_seen_now = false;
};

/// Mean and spread along an axis.
struct Moments {
  double sum = 0.0;
  double squares = 0.0;
};

double log_odds(double hits, double misses) { return std::log(hits / misses); }

/// Passes that saw and missed, and others that did or were for nothing: all that can be.
Axis recall_axis(double seen, double may_be_seen, double missed, double may_be_missed) {
  const double margin = kSigmas * (1.0 / std::sqrt(seen + may_be_seen) + 1.0 / std::sqrt(missed));
  const double most = std::min(margin, 12.0);
  return {log_odds(seen, missed + may_be_missed) - most,
          log_odds(seen + may_be_seen, missed) + most};
}

Axis closer(const Axis& axis, const Moments& moments, double total) {
  if (axis.steps() == 1) return axis;
  const double mean = moments.sum / total;
  const double sigma = std::sqrt(std::max(0.0, moments.squares / total - mean * mean));
  const double cell = (axis.to - axis.from) / static_cast<double>(kSteps);
  const double half = std::max(kSigmas * sigma, 1.5 * cell);
  return {std::max(axis.from, mean - half), std::min(axis.to, mean + half)};
}

/// The posterior, up to a factor.
class Posterior {
 public:
  /// `share`: what passes before this drive count for; `counts` are so already.
  Posterior(const LearnedRates& counts, double went, double exposure_s, double share,
            std::vector<History> histories)
      : counts_(counts),
        went_(std::max(kLeastOf, went)),
        exposure_s_(std::max(kLeastOf, exposure_s)),
        share_(share),
        histories_(std::move(histories)) {}

  Axis now_axis() const {
    double seen = 0.0, missed = 0.0;
    for (const History& one : histories_) {
      seen += one.is_seen_now ? one.points : 0.0;
      missed += one.points * one.missed_now;
    }
    return recall_axis(counts_.now_seen, seen, counts_.now_missed, missed);
  }
  Axis before_axis() const {
    double missed = 0.0;
    for (const History& one : histories_) missed += one.points * one.missed_before;
    return recall_axis(counts_.before_seen, 0.0, counts_.before_missed, missed);
  }
  /// From none of the missing to all of them.
  Axis decay_axis() const {
    double missing = 0.0, exposure_s = 0.0;
    for (const History& one : histories_) {
      missing += one.is_seen_now ? 0.0 : one.points;
      exposure_s += one.points * one.since_s;
    }
    const double margin = kSigmas / std::sqrt(std::clamp(went_, 0.5, 16.0));
    return {std::log(went_ / (exposure_s_ + exposure_s)) - margin,
            std::log((went_ + missing) / exposure_s_) + margin};
  }

  /// Means over a grid: v of now and of before, lambda. The axes close in.
  std::array<double, 3> sum_up(Axes& axes) const {
    const std::vector<double> logs = log_densities(axes);
    const double most = *std::ranges::max_element(logs);
    std::array<Moments, 3> moments{};
    std::array<double, 3> means{};
    double total = 0.0;
    std::size_t cell = 0;
    for (std::size_t i = 0; i < axes[0].steps(); ++i) {
      for (std::size_t k = 0; k < axes[1].steps(); ++k) {
        for (std::size_t l = 0; l < axes[2].steps(); ++l) {
          const double weight = std::exp(logs[cell++] - most);
          const std::array<double, 3> at{axes[0].at(i), axes[1].at(k), axes[2].at(l)};
          total += weight;
          for (std::size_t axis = 0; axis < 3; ++axis) {
            moments[axis].sum += weight * at[axis];
            moments[axis].squares += weight * at[axis] * at[axis];
            const double value = std::exp(at[axis]);
            means[axis] += weight * (axis < 2 ? probability_of(value) : value);
          }
        }
      }
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      axes[axis] = closer(axes[axis], moments[axis], total);
      means[axis] /= total;
    }
    return means;
  }

 private:
  /// Beta of log-odds.
  static double log_beta(double seen, double missed, double odds) {
    const double log_miss = -std::log1p(std::exp(odds));
    return seen * (log_miss + odds) + missed * log_miss;
  }

  /// Of each cell; lambda fastest.
  std::vector<double> log_densities(const Axes& axes) const {
    const auto& [now, before, decay] = axes;
    std::vector<double> logs;
    logs.reserve(now.steps() * before.steps() * decay.steps());
    for (std::size_t i = 0; i < now.steps(); ++i) {
      const double of_now = log_beta(counts_.now_seen, counts_.now_missed, now.at(i));
      for (std::size_t k = 0; k < before.steps(); ++k) {
        const double of_before = log_beta(counts_.before_seen, counts_.before_missed, before.at(k));
        for (std::size_t l = 0; l < decay.steps(); ++l)
          logs.push_back(of_now + of_before + went_ * decay.at(l) -
                         exposure_s_ * std::exp(decay.at(l)));
      }
    }
    for (const History& one : histories_) add(one, axes, logs);
    return logs;
  }

  /// (1 - v)^missed at each step.
  static std::array<double, kSteps> chances_to_miss(const Axis& axis, double missed) {
    std::array<double, kSteps> chances{};
    for (std::size_t i = 0; i < axis.steps(); ++i)
      chances[i] = std::exp(-missed * std::log1p(std::exp(axis.at(i))));
    return chances;
  }

  /// v at each step, or its part that the looks rule out.
  static std::array<double, kSteps> chances_to_see(const Axis& axis, const History& one) {
    std::array<double, kSteps> chances{};
    for (std::size_t i = 0; i < axis.steps(); ++i)
      chances[i] = (one.is_seen_now ? 1.0 : one.missed_now) * probability_of(std::exp(axis.at(i)));
    return chances;
  }

  void add(const History& one, const Axes& axes, std::vector<double>& logs) const {
    const std::array<double, kSteps> by_now = chances_to_see(axes[0], one);
    const auto by_before = chances_to_miss(axes[1], one.missed_before);
    std::array<double, kSteps> lost{};
    for (std::size_t l = 0; l < axes[2].steps(); ++l)
      lost[l] = lost_share(std::exp(axes[2].at(l)), one.since_s);

    for (std::size_t k = 0; k < axes[1].steps(); ++k) {
      for (std::size_t l = 0; l < axes[2].steps(); ++l) {
        const double missed = lost[l] + (1.0 - lost[l]) * by_before[k];
        const double there = (1.0 - lost[l]) * by_before[k] / std::max(kTiny, missed);
        const double before = share_ * std::log(std::max(kTiny, missed));
        for (std::size_t i = 0; i < axes[0].steps(); ++i) {
          const double seen = there * by_now[i];
          const double now = std::log(std::max(kTiny, one.is_seen_now ? seen : 1.0 - seen));
          logs[(i * axes[1].steps() + k) * axes[2].steps() + l] += one.points * (before + now);
        }
      }
    }
  }

  LearnedRates counts_;
  double went_;
  double exposure_s_;
  double share_;
  std::vector<History> histories_;
};

int step_of(double value) { return static_cast<int>(std::round(value)); }

std::int64_t parts_of(double value, double parts) {
  return static_cast<std::int64_t>(std::round(value * parts));
}

}  // namespace

std::array<double, LearnedRates::kNumbers> LearnedRates::store() const {
  return {now, before, before_was, decay_per_s, now_seen, now_missed, before_seen, before_missed};
}

LearnedRates LearnedRates::restored(const std::array<double, kNumbers>& numbers) {
  for (const double number : numbers)
    if (!std::isfinite(number) || number < 0.0)
      throw std::invalid_argument("existence: what was learned is not finite or below 0");
  if (numbers[0] >= 1.0 || numbers[1] >= 1.0 || numbers[2] >= 1.0)
    throw std::invalid_argument("existence: a learned recall is not below 1");
  return {numbers[0], numbers[1], numbers[2], numbers[3],
          numbers[4], numbers[5], numbers[6], numbers[7]};
}

void PassHistories::count(const OpenHistory& history, std::int64_t times) {
  const auto went = static_cast<double>(history.counted.went);
  went_ += times * parts_of(went, kWentParts);
  exposure_ +=
      times * parts_of((1.0 - went) * static_cast<double>(history.counted.since_s), kSecondParts);
  const double before = std::min(history.missed_before, kMostMissed);
  const auto since_s = static_cast<double>(history.since_s);
  const std::array<int, 4> key{step_of(kPerPass * before), step_of(kPerPass * history.missed_now),
                               step_of(kPerFactor * std::log(1.0 + since_s)),
                               history.is_seen_now ? 1 : 0};
  if (key[0] == 0 && key[1] == 0 && key[3] == 0) return;
  Alike& sums = alike_[key];
  sums.points += times;
  sums.missed_before += times * parts_of(before, kPassParts);
  sums.missed_now += times * parts_of(history.missed_now, kPassParts);
  sums.since += times * parts_of(since_s, kSecondParts);
  missed_before_ += times * parts_of(before, kPassParts);
  if (sums.points == 0) alike_.erase(key);
}

LearnedRates PassHistories::rates(const LearnedRates& until_now, const RatePriors& priors,
                                  double went, double exposure_s, bool learns_recall,
                                  bool learns_decay) const {
  std::vector<History> histories;
  histories.reserve(alike_.size());
  for (const auto& [key, sums] : alike_) {
    const auto points = static_cast<double>(sums.points);
    const auto mean = [points](std::int64_t sum, double parts) {
      return static_cast<double>(sum) / parts / points;
    };
    histories.push_back({points, mean(sums.missed_before, kPassParts),
                         mean(sums.missed_now, kPassParts), mean(sums.since, kSecondParts),
                         key[3] == 1});
  }

  const double passes = until_now.before_seen + until_now.before_missed +
                        static_cast<double>(missed_before_) / kPassParts;
  went -= static_cast<double>(went_) / kWentParts;
  exposure_s -= static_cast<double>(exposure_) / kSecondParts;
  const double share = std::min(1.0, kMostPasses / passes);
  const auto so_much_of = [share](double counted, double prior) {
    return prior + share * std::max(0.0, counted - prior);
  };
  LearnedRates counts = until_now;
  counts.before_seen = so_much_of(until_now.before_seen, priors.seen);
  counts.before_missed = so_much_of(until_now.before_missed, priors.missed);
  const Posterior posterior(counts, so_much_of(went, priors.went),
                            so_much_of(exposure_s, priors.exposure_s), share, std::move(histories));

  const auto fixed = [](double log) { return Axis{log, log}; };
  Axes axes{fixed(log_odds(until_now.now, 1.0 - until_now.now)),
            fixed(log_odds(until_now.before, 1.0 - until_now.before)),
            fixed(std::log(std::max(kTiny, until_now.decay_per_s)))};
  if (learns_recall) axes[0] = posterior.now_axis();
  if (learns_recall) axes[1] = posterior.before_axis();
  if (learns_decay) axes[2] = posterior.decay_axis();
  std::array<double, 3> means{};
  for (int zoom = 0; zoom < kZooms; ++zoom) means = posterior.sum_up(axes);

  LearnedRates after = until_now;
  after.before_was = until_now.before;
  if (learns_recall) after.now = means[0];
  if (learns_recall) after.before = means[1];
  if (learns_decay) after.decay_per_s = means[2];
  return after;
}

}  // namespace understory::existence
