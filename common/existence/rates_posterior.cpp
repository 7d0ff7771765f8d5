#include "common/existence/rates_posterior.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "common/existence/odds.hpp"

namespace understory::existence {
namespace {

constexpr double kLeastOf = 1e-3;
constexpr double kTiny = std::numeric_limits<double>::min();

constexpr std::size_t kSteps = 12;
/// The grid closes in on the posterior so often: from all that can be to this many sigmas.
constexpr int kZooms = 5;
constexpr double kSigmas = 4.0;
/// Most log-odds of a v.
constexpr double kMostLogOdds = 14.0;

/// One axis of the grid: log-odds of v before or the logarithm of lambda.
struct Axis {
  double from = 0.0;
  double to = 0.0;
  double at(std::size_t step) const {
    return from + (to - from) * (static_cast<double>(step) + 0.5) / static_cast<double>(kSteps);
  }
  std::size_t steps() const { return to > from ? kSteps : 1; }
  /// Of a cell; 1 where there is but one.
  double width() const { return to > from ? (to - from) / static_cast<double>(kSteps) : 1.0; }
};

/// Mean and spread along an axis.
struct Moments {
  double sum = 0.0;
  double squares = 0.0;
};

struct BetaPrior {
  double seen = 0.0;
  double missed = 0.0;
  double log_norm() const {
    return std::lgamma(seen) + std::lgamma(missed) - std::lgamma(seen + missed);
  }
};

/// Of one v: how likely it is, up to a factor that all share, and its mean.
struct Weighed {
  double log_evidence = 0.0;
  double mean = 0.0;
};

/// Of a drive that is like those before or like none: how likely that is, up to a factor, and what
/// its v, v before and lambda are then.
struct Summed {
  double log_evidence = 0.0;
  std::array<double, 3> means{};
};

/// What this drive's looks say of its v where v before and lambda are given: points that it sees,
/// and those that it missed, by the probability that they are there and were looked at.
class ThisDrive {
 public:
  void see(double points) { seen_ += points; }
  void miss(double points, double chance) {
    const auto bin = std::min(kBins - 1, static_cast<std::size_t>(chance * kBins));
    points_[bin] += points;
    chances_[bin] += points * chance;
  }
  void close() {
    for (std::size_t i = 0; i < kBins; ++i)
      if (points_[i] > 0.0) chances_[i] /= points_[i];
  }

  /// At one v.
  double log_likelihood(double v) const {
    double log = seen_ * std::log(std::max(kTiny, v));
    for (std::size_t i = 0; i < kBins; ++i)
      if (points_[i] > 0.0) log += points_[i] * std::log(std::max(kTiny, 1.0 - chances_[i] * v));
    return log;
  }

  /// Summed up over all v.
  Weighed over(const BetaPrior& prior) const {
    const auto [mode, sigma] = peak(prior);
    const double top = log_density(prior, mode);
    double total = 0.0, mean = 0.0;
    for (int step = -kReach; step <= kReach; ++step) {
      const double x = mode + sigma * step / kPerSigma;
      const double weight = std::exp(std::min(0.0, log_density(prior, x) - top));
      total += weight;
      mean += weight * probability_of(std::exp(x));
    }
    return {top + std::log(total * sigma / kPerSigma) - prior.log_norm(), mean / total};
  }

 private:
  static constexpr std::size_t kBins = 16;
  static constexpr int kReach = 4;
  static constexpr int kPerSigma = 1;

  /// By log-odds.
  double log_density(const BetaPrior& prior, double x) const {
    const double log_miss = -std::log1p(std::exp(x));
    return prior.seen * (log_miss + x) + prior.missed * log_miss +
           log_likelihood(probability_of(std::exp(x)));
  }

  /// Where that is highest, by Newton's steps, and its width there.
  std::pair<double, double> peak(const BetaPrior& prior) const {
    double missed = prior.missed;
    for (std::size_t i = 0; i < kBins; ++i) missed += points_[i] * chances_[i];
    double x = std::log((prior.seen + seen_) / missed);
    double bend = 1.0;
    for (int round = 0; round < 12; ++round) {
      const double v = probability_of(std::exp(x));
      const double vu = v * (1.0 - v);
      const double all = prior.seen + seen_ + prior.missed;
      double slope = (prior.seen + seen_) * (1.0 - v) - prior.missed * v;
      bend = all * vu;
      for (std::size_t i = 0; i < kBins; ++i) {
        if (points_[i] <= 0.0) continue;
        const double a = chances_[i], there = 1.0 - a * v;
        slope -= points_[i] * a * vu / there;
        bend += points_[i] * a * vu * (1.0 - 2.0 * v + a * v * v) / (there * there);
      }
      bend = std::max({bend, 0.2 * all * vu, kLeastOf});
      const double step = std::clamp(slope / bend, -1.5, 1.5);
      x = std::clamp(x + step, -kMostLogOdds, kMostLogOdds);
      if (std::abs(step) < 0.01 / std::sqrt(bend)) break;
    }
    return {x, std::min(2.0, 1.0 / std::sqrt(bend))};
  }

  double seen_ = 0.0;
  std::array<double, kBins> points_{};
  std::array<double, kBins> chances_{};  ///< Means, when closed.
};

class Posterior {
 public:
  Posterior(const RateEvidence& evidence, bool is_alike, double fixed_v)
      : evidence_(evidence),
        is_alike_(is_alike),
        fixed_v_(fixed_v),
        went_(std::max(kLeastOf, evidence.went)),
        exposure_s_(std::max(kLeastOf, evidence.exposure_s)) {}

  Axis before_axis() const {
    double missed = 0.0;
    for (const AlikePoints& one : evidence_.histories) missed += one.points * one.missed_before;
    const double seen = evidence_.before_seen, fewest = evidence_.before_missed;
    const double margin =
        std::min(12.0, kSigmas * (1.0 / std::sqrt(seen) + 1.0 / std::sqrt(fewest)));
    return {std::max(-kMostLogOdds, std::log(seen / (fewest + missed)) - margin),
            std::min(kMostLogOdds, std::log(seen / fewest) + margin)};
  }
  /// From none of the missing to all of them.
  Axis decay_axis() const {
    double missing = 0.0, exposure_s = exposure_s_;
    for (const AlikePoints& one : evidence_.histories) {
      missing += one.is_seen_now ? 0.0 : one.points;
      exposure_s += one.points * one.since_s;
    }
    const double margin = kSigmas / std::sqrt(std::clamp(went_, 0.5, 16.0));
    return {std::log(went_ / exposure_s) - margin,
            std::log((went_ + missing) / exposure_s_) + margin};
  }

  /// Over a grid. The axes close in.
  Summed sum_up(Axis& before, Axis& decay) const {
    std::vector<Weighed> cells;
    cells.reserve(before.steps() * decay.steps());
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < before.steps(); ++k) {
      for (std::size_t l = 0; l < decay.steps(); ++l) {
        cells.push_back(weigh(before.at(k), decay.at(l)));
        most = std::max(most, cells.back().log_evidence);
      }
    }
    Moments of_before, of_decay;
    std::array<double, 3> means{};
    double total = 0.0;
    for (std::size_t k = 0, cell = 0; k < before.steps(); ++k) {
      for (std::size_t l = 0; l < decay.steps(); ++l, ++cell) {
        const double weight = std::exp(cells[cell].log_evidence - most);
        total += weight;
        add(of_before, weight, before.at(k));
        add(of_decay, weight, decay.at(l));
        means[0] += weight * cells[cell].mean;
        means[1] += weight * probability_of(std::exp(before.at(k)));
        means[2] += weight * std::exp(decay.at(l));
      }
    }
    const double log_evidence = most + std::log(total * before.width() * decay.width());
    before = closer(before, of_before, total);
    decay = closer(decay, of_decay, total);
    for (double& mean : means) mean /= total;
    return {log_evidence, means};
  }

 private:
  static void add(Moments& moments, double weight, double at) {
    moments.sum += weight * at;
    moments.squares += weight * at * at;
  }

  static Axis closer(const Axis& axis, const Moments& moments, double total) {
    if (axis.steps() == 1) return axis;
    const double mean = moments.sum / total;
    const double sigma = std::sqrt(std::max(0.0, moments.squares / total - mean * mean));
    const double cell = (axis.to - axis.from) / static_cast<double>(kSteps);
    const double half = std::max(kSigmas * sigma, 1.5 * cell);
    return {std::max(axis.from, mean - half), std::min(axis.to, mean + half)};
  }

  /// One cell; all v of this drive are summed up there.
  Weighed weigh(double odds, double log_decay) const {
    const double log_miss = -std::log1p(std::exp(odds));
    double log = evidence_.before_seen * (log_miss + odds) + evidence_.before_missed * log_miss +
                 went_ * log_decay - exposure_s_ * std::exp(log_decay);
    ThisDrive drive;
    for (const AlikePoints& one : evidence_.histories) {
      const double rate = std::exp(log_decay);
      const double lost = lost_share(rate, one.until_missed_s);
      const double hidden = (1.0 - lost) * std::exp(one.missed_before * log_miss);
      const double missed = std::max(kTiny, lost + hidden);
      const double there = hidden / missed * std::exp(-rate * (one.since_s - one.until_missed_s));
      log += one.points * evidence_.share * std::log(missed);
      if (one.is_seen_now) {
        log += one.points * std::log(std::max(kTiny, there));
        drive.see(one.points);
      } else {
        const double by_rays = 1.0 + there * (one.rays - 1.0);
        log += one.points * std::log(std::max(kTiny, by_rays));
        drive.miss(one.points, there * one.rays / by_rays * one.missed_now);
      }
    }
    drive.close();
    if (fixed_v_ > 0.0) return {log + drive.log_likelihood(fixed_v_), fixed_v_};

    const RatePriors& priors = evidence_.priors;
    const double v = probability_of(std::exp(odds));
    const Weighed now = is_alike_ ? drive.over({priors.alike * v, priors.alike * (1.0 - v)})
                                  : drive.over({priors.seen, priors.missed});
    const double share = is_alike_ ? 1.0 - priors.unlike : priors.unlike;
    return {log + std::log(share) + now.log_evidence, now.mean};
  }

  const RateEvidence& evidence_;
  bool is_alike_;
  double fixed_v_;
  double went_;
  double exposure_s_;
};

/// Each by a grid of its own: one is narrow where the other is wide.
Summed sum_up(const RateEvidence& evidence, const LearnedRates& until_now, bool is_alike,
              bool learns_recall, bool learns_decay) {
  const Posterior posterior(evidence, is_alike, learns_recall ? 0.0 : until_now.now);
  const auto fixed = [](double log) { return Axis{log, log}; };
  Axis before = fixed(std::log(until_now.before / (1.0 - until_now.before)));
  Axis decay = fixed(std::log(std::max(kTiny, until_now.decay_per_s)));
  if (learns_recall) before = posterior.before_axis();
  if (learns_decay) decay = posterior.decay_axis();
  Summed summed;
  for (int zoom = 0; zoom < kZooms; ++zoom) summed = posterior.sum_up(before, decay);
  return summed;
}

}  // namespace

LearnedRates posterior_means(const RateEvidence& evidence, const LearnedRates& until_now,
                             bool learns_recall, bool learns_decay) {
  Summed summed = sum_up(evidence, until_now, true, learns_recall, learns_decay);
  if (learns_recall) {
    const Summed unlike = sum_up(evidence, until_now, false, learns_recall, learns_decay);
    const double share =
        probability_of(std::exp(std::min(600.0, summed.log_evidence - unlike.log_evidence)));
    for (std::size_t i = 0; i < summed.means.size(); ++i)
      summed.means[i] = std::lerp(unlike.means[i], summed.means[i], share);
  }
  LearnedRates after = until_now;
  after.before_was = until_now.before;
  if (learns_recall) after.now = summed.means[0];
  if (learns_recall) after.before = summed.means[1];
  if (learns_decay) after.decay_per_s = summed.means[2];
  return after;
}

}  // namespace understory::existence
