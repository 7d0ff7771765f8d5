#include "common/existence/rates_posterior.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "common/existence/odds.hpp"
#include "common/existence/pass_occluder.hpp"

namespace understory::existence {
namespace {

constexpr double kLeastOf = 1e-3;
constexpr double kTiny = std::numeric_limits<double>::min();

constexpr std::size_t kSteps = 12;
/// The grid is narrowed to the posterior kZooms times: from the whole range to kSigmas sigmas.
constexpr int kZooms = 5;
constexpr double kSigmas = 4.0;
/// Largest log-odds of v.
constexpr double kMostLogOdds = 14.0;

/// One axis of the grid: log-odds of v before or the logarithm of lambda.
struct Axis {
  double from = 0.0;
  double to = 0.0;
  double at(std::size_t step) const {
    return from + (to - from) * (static_cast<double>(step) + 0.5) / static_cast<double>(kSteps);
  }
  std::size_t steps() const { return to > from ? kSteps : 1; }
  /// Width of a cell; 1 if there is one cell.
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

/// Evidence for one v, up to a common factor, and its mean.
struct Weighed {
  double log_evidence = 0.0;
  double mean = 0.0;
};

/// Cause of a drive's misses.
enum class Drive : std::uint8_t {
  kAlike,   ///< As on earlier drives: v is near theirs.
  kUnlike,  ///< As on no earlier drive: v is arbitrary.
  kHidden,  ///< v of earlier drives, and an obstacle hides points observed from one side.
};

/// v of this drive, v before, lambda, and the hidden share of points observed from one side.
using Means = std::array<double, 4>;

/// Evidence for one kind of drive, up to a factor, and the mean rates given that kind.
struct Summed {
  double log_evidence = 0.0;
  Means means{};
};

/// Likelihood of this drive's v for a given v before and lambda: points that it sees, and points
/// that it missed, by the probability that they exist and were observed. Or the likelihood of the
/// share that is not hidden, if v is given too.
class ThisDrive {
 public:
  void see(double points) { seen_ += points; }
  void miss(double points, double chance) {
    const auto bin =
        static_cast<std::size_t>(chance < 0.0 ? (chance < -1.0 ? 0.0 : 1.0)
                                              : std::min(2.0 + chance * kMisses, kMisses + 1.0));
    points_[bin] += points;
    chances_[bin] += points * chance;
  }
  void close() {
    for (std::size_t i = 0; i < kBins; ++i)
      if (points_[i] > 0.0) chances_[i] /= points_[i];
  }

  /// Log likelihood at one v.
  double log_likelihood(double v) const {
    double log = seen_ * std::log(std::max(kTiny, v));
    for (std::size_t i = 0; i < kBins; ++i)
      if (points_[i] > 0.0) log += points_[i] * std::log(std::max(kTiny, 1.0 - chances_[i] * v));
    return log;
  }

  /// Integral over all v.
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
  /// Bins of the chances; the first two are for chances below 0: points seen though part of them
  /// was hidden.
  static constexpr std::size_t kBins = 18;
  static constexpr double kMisses = 16.0;
  static constexpr int kReach = 4;
  static constexpr int kPerSigma = 1;

  /// Log density as a function of the log-odds.
  double log_density(const BetaPrior& prior, double x) const {
    const double log_miss = -std::log1p(std::exp(x));
    return prior.seen * (log_miss + x) + prior.missed * log_miss +
           log_likelihood(probability_of(std::exp(x)));
  }

  /// Maximum of the density by Newton's method, and its width there.
  std::pair<double, double> peak(const BetaPrior& prior) const {
    double missed = prior.missed;
    for (std::size_t i = 2; i < kBins; ++i) missed += points_[i] * chances_[i];
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
  std::array<double, kBins> chances_{};  ///< Means after close().
};

class Posterior {
 public:
  Posterior(const RateEvidence& evidence, Drive kind, double fixed_v)
      : evidence_(evidence),
        kind_(kind),
        fixed_v_(fixed_v),
        went_(std::max(kLeastOf, evidence.went)),
        exposure_s_(std::max(kLeastOf, evidence.exposure_s)) {}

  Axis before_axis() const {
    double missed = 0.0;
    for (const AlikePoints& one : evidence_.histories)
      missed += one.points * (one.missed_before + one.hidden_before);
    const double seen = evidence_.before_seen, fewest = evidence_.before_missed;
    const double margin =
        std::min(12.0, kSigmas * (1.0 / std::sqrt(seen) + 1.0 / std::sqrt(fewest)));
    return {std::max(-kMostLogOdds, std::log(seen / (fewest + missed)) - margin),
            std::min(kMostLogOdds, std::log(seen / fewest) + margin)};
  }
  /// From none of the missing points removed to all of them.
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

  /// Integral over a grid. The axes are narrowed.
  Summed sum_up(Axis& before, Axis& decay) const {
    std::vector<Weighed> cells;
    cells.reserve(before.steps() * decay.steps());
    double most = -std::numeric_limits<double>::infinity();
    std::vector<std::vector<Stay>> stays;
    for (std::size_t l = 0; l < decay.steps(); ++l) stays.push_back(stays_at(decay.at(l)));
    for (std::size_t k = 0; k < before.steps(); ++k) {
      const std::vector<double> missed = missed_at(before.at(k));
      for (std::size_t l = 0; l < decay.steps(); ++l) {
        cells.push_back(weigh(before.at(k), decay.at(l), missed, stays[l]));
        most = std::max(most, cells.back().log_evidence);
      }
    }
    Moments of_before, of_decay;
    Means means{};
    double total = 0.0;
    for (std::size_t k = 0, cell = 0; k < before.steps(); ++k) {
      for (std::size_t l = 0; l < decay.steps(); ++l, ++cell) {
        const double weight = std::exp(cells[cell].log_evidence - most);
        total += weight;
        add(of_before, weight, before.at(k));
        add(of_decay, weight, decay.at(l));
        const double v_before = probability_of(std::exp(before.at(k)));
        const bool is_hidden = kind_ == Drive::kHidden;
        means[0] += weight * (is_hidden ? v_before : cells[cell].mean);
        means[1] += weight * v_before;
        means[2] += weight * std::exp(decay.at(l));
        means[3] += is_hidden ? weight * (1.0 - cells[cell].mean) : 0.0;
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

  /// Probabilities of a history at one lambda: removed before the first miss, and existing from
  /// then until now.
  struct Stay {
    double lost = 0.0;
    double later = 1.0;
  };
  std::vector<Stay> stays_at(double log_decay) const {
    const double rate = std::exp(log_decay);
    std::vector<Stay> stays;
    stays.reserve(evidence_.histories.size());
    for (const AlikePoints& one : evidence_.histories)
      stays.push_back({lost_share(rate, one.until_missed_s),
                       std::exp(-rate * (one.since_s - one.until_missed_s))});
    return stays;
  }
  /// For each history, at one v before: probability that all its passes miss an existing point.
  std::vector<double> missed_at(double odds) const {
    const double log_miss = -std::log1p(std::exp(odds));
    const double hidden = PassOccluder::missed_when_hidden(std::exp(log_miss));
    std::vector<double> missed;
    missed.reserve(evidence_.histories.size());
    for (const AlikePoints& one : evidence_.histories) {
      double chance = std::exp(one.missed_before * log_miss);
      for (int pass = 0; pass < one.hidden_before; ++pass) chance *= hidden;
      missed.push_back(chance);
    }
    return missed;
  }

  /// One cell: the integral over all v of this drive, or over all shares that are not hidden.
  Weighed weigh(double odds, double log_decay, const std::vector<double>& all_missed,
                const std::vector<Stay>& stays) const {
    const double log_miss = -std::log1p(std::exp(odds));
    const double v = probability_of(std::exp(odds));
    double log = evidence_.before_seen * (log_miss + odds) + evidence_.before_missed * log_miss +
                 went_ * log_decay - exposure_s_ * std::exp(log_decay);
    ThisDrive drive;
    for (std::size_t i = 0; i < evidence_.histories.size(); ++i) {
      const AlikePoints& one = evidence_.histories[i];
      const double lost = stays[i].lost;
      const double unseen = (1.0 - lost) * all_missed[i];
      const double missed = std::max(kTiny, lost + unseen);
      const double there = unseen / missed * stays[i].later;
      const double by_rays = one.is_seen_now ? there : 1.0 + there * (one.rays - 1.0);
      log += one.points * (evidence_.share * std::log(missed) + std::log(std::max(kTiny, by_rays)));
      const double chance = one.is_seen_now ? 1.0 : there * one.rays / by_rays * one.missed_now;
      if (kind_ == Drive::kHidden)
        log += look(drive, one, chance * v);
      else if (one.is_seen_now)
        drive.see(one.points);
      else
        drive.miss(one.points, chance);
    }
    drive.close();
    if (fixed_v_ > 0.0) return {log + drive.log_likelihood(fixed_v_), fixed_v_};

    const RatePriors& priors = evidence_.priors;
    const auto with = [&](const BetaPrior& prior, double share) {
      const Weighed now = drive.over(prior);
      return Weighed{log + std::log(share) + now.log_evidence, now.mean};
    };
    switch (kind_) {
      case Drive::kUnlike:
        return with({priors.seen, priors.missed}, priors.unlike * (1.0 - priors.hidden));
      case Drive::kHidden:
        return with({1.0, 1.0}, (1.0 - priors.unlike) * priors.hidden);
      default:
        return with({priors.alike * v, priors.alike * (1.0 - v)},
                    (1.0 - priors.unlike) * (1.0 - priors.hidden));
    }
  }

  /// Points that are seen with `chance` when not hidden, as a function of the share x that is not
  /// hidden: seen with chance (1 - part + part x), else missed. Returns the part of the logarithm
  /// without x.
  static double look(ThisDrive& view, const AlikePoints& one, double chance) {
    const double part = hides_all(one.sides), rest = 1.0 - part;
    if (!one.is_seen_now) {
      const double not_seen = std::max(kTiny, 1.0 - chance * rest);
      if (part > 0.0) view.miss(one.points, chance * part / not_seen);
      return one.points * std::log(not_seen);
    }
    if (part >= 1.0) {
      view.see(one.points);
      return one.points * std::log(std::max(kTiny, chance));
    }
    if (part > 0.0) view.miss(one.points, -part / rest);
    return one.points * std::log(std::max(kTiny, chance * rest));
  }

  const RateEvidence& evidence_;
  Drive kind_;
  double fixed_v_;
  double went_;
  double exposure_s_;
};

/// Each kind has a grid of its own: one is narrow where the other is wide.
Summed sum_up(const RateEvidence& evidence, const LearnedRates& until_now, Drive kind,
              bool learns_recall, bool learns_decay) {
  const Posterior posterior(evidence, kind, learns_recall ? 0.0 : until_now.now);
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
  std::vector<Summed> kinds{
      sum_up(evidence, until_now, Drive::kAlike, learns_recall, learns_decay)};
  if (learns_recall)
    for (const Drive kind : {Drive::kUnlike, Drive::kHidden})
      kinds.push_back(sum_up(evidence, until_now, kind, learns_recall, learns_decay));
  double most = kinds.front().log_evidence, total = 0.0;
  for (const Summed& kind : kinds) most = std::max(most, kind.log_evidence);
  Means means{};
  for (const Summed& kind : kinds) {
    const double weight = std::exp(kind.log_evidence - most);
    total += weight;
    for (std::size_t i = 0; i < means.size(); ++i) means[i] += weight * kind.means[i];
  }
  for (double& mean : means) mean /= total;
  LearnedRates after = until_now;
  after.before_was = until_now.before;
  if (learns_recall) after.now = means[0];
  if (learns_recall) after.before = means[1];
  after.hidden = means[3];
  if (learns_decay) after.decay_per_s = means[2];
  return after;
}

}  // namespace understory::existence
