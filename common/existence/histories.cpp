#include "common/existence/histories.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "common/existence/rates_posterior.hpp"

namespace understory::existence {
namespace {

/// Similar histories differ by less than a quarter of a pass and an eighth of the time. More misses
/// than kMostMissed add no evidence.
constexpr double kPerPass = 4.0;
constexpr double kPerFactor = 8.0;
constexpr double kMostMissed = 16.0;
/// With beams behind it from this many sides the point is surely removed.
constexpr int kMostSides = 4;
/// A side is 40 degrees wide, and a slow vehicle may see across the border of two sides.
/// Probability that an obstacle that hides a point from one of n sides hides it from all of them.
constexpr std::array kHidesSides{1.0, 0.7, 0.1};
constexpr int kMostHidden = 3;
/// Units in which histories are counted: parts of a pass, of a second and of a removed point.
constexpr double kPassParts = 1024.0;
constexpr double kSecondParts = 16.0;
constexpr double kWentParts = 1 << 24;
int step_of(double value) { return static_cast<int>(std::round(value)); }

std::int64_t parts_of(double value, double parts) {
  return static_cast<std::int64_t>(std::round(value * parts));
}

}  // namespace

std::array<double, LearnedRates::kNumbers> LearnedRates::store() const {
  return {now, before, before_was, decay_per_s, hidden, 0.0, before_seen, before_missed};
}

LearnedRates LearnedRates::restored(const std::array<double, kNumbers>& numbers) {
  for (const double number : numbers)
    if (!std::isfinite(number) || number < 0.0)
      throw std::invalid_argument("existence: what was learned is not finite or below 0");
  if (numbers[0] >= 1.0 || numbers[1] >= 1.0 || numbers[2] >= 1.0 || numbers[4] >= 1.0)
    throw std::invalid_argument("existence: a learned share is not below 1");
  return {numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[6], numbers[7]};
}

double hides_all(int sides) {
  return sides < 1 || sides > kMostHidden ? 0.0 : kHidesSides[static_cast<std::size_t>(sides - 1)];
}

void PassHistories::count(const OpenHistory& history, std::int64_t times) {
  const auto went = static_cast<double>(history.counted.went);
  went_ += times * parts_of(went, kWentParts);
  exposure_ +=
      times * parts_of((1.0 - went) * static_cast<double>(history.counted.since_s), kSecondParts);

  // The key of similar histories.
  const double before = std::min(history.missed_before, kMostMissed);
  const auto since_s = static_cast<double>(history.since_s);
  // Without a miss the point may have been removed at any time until now.
  const double until_s = before > 0.0 || history.hidden_before > 0
                             ? std::min(since_s, static_cast<double>(history.until_missed_s))
                             : since_s;
  const std::array<int, 9> key{step_of(kPerPass * before),
                               step_of(kPerPass * history.missed_now),
                               step_of(kPerFactor * std::log(1.0 + since_s)),
                               step_of(kPerFactor * std::log(1.0 + until_s)),
                               history.is_seen_now ? 1 : 0,
                               step_of(kPerFactor * std::log(history.rays)),
                               std::min(kMostSides, history.passed),
                               std::min(kMostHidden + 1, history.sides),
                               history.hidden_before};
  if (key[0] == 0 && key[1] == 0 && key[4] == 0 && key[5] == 0 && key[6] == 0 && key[8] == 0)
    return;

  // The sums.
  Alike& sums = alike_[key];
  sums.points += times;
  sums.missed_before += times * parts_of(before, kPassParts);
  sums.missed_now += times * parts_of(history.missed_now, kPassParts);
  sums.since += times * parts_of(since_s, kSecondParts);
  sums.until_missed += times * parts_of(until_s, kSecondParts);
  sums.rays += times * parts_of(history.rays, kPassParts);
  missed_before_ += times * parts_of(before + history.hidden_before, kPassParts);
  if (sums.points == 0) alike_.erase(key);
}

LearnedRates PassHistories::rates(const LearnedRates& until_now, const RatePriors& priors,
                                  double went, double exposure_s, bool learns_recall,
                                  bool learns_decay) const {
  RateEvidence evidence;
  evidence.priors = priors;
  evidence.histories.reserve(alike_.size());
  for (const auto& [key, sums] : alike_) {
    const auto points = static_cast<double>(sums.points);
    const auto mean = [points](std::int64_t sum, double parts) {
      return static_cast<double>(sum) / parts / points;
    };
    const double by_sides = std::pow(priors.passed_by, key[6]);
    evidence.histories.push_back({points, mean(sums.missed_before, kPassParts),
                                  mean(sums.missed_now, kPassParts), mean(sums.since, kSecondParts),
                                  mean(sums.until_missed, kSecondParts), key[4] == 1,
                                  by_sides * mean(sums.rays, kPassParts), key[7], key[8]});
  }

  const double passes = until_now.before_seen + until_now.before_missed +
                        static_cast<double>(missed_before_) / kPassParts;
  const double share = std::min(1.0, priors.alike / passes);
  const auto so_much_of = [share](double counted, double prior) {
    return prior + share * std::max(0.0, counted - prior);
  };
  evidence.share = share;
  evidence.before_seen = so_much_of(until_now.before_seen, priors.seen);
  evidence.before_missed = so_much_of(until_now.before_missed, priors.missed);
  evidence.went = so_much_of(went - static_cast<double>(went_) / kWentParts, priors.went);
  evidence.exposure_s =
      so_much_of(exposure_s - static_cast<double>(exposure_) / kSecondParts, priors.exposure_s);
  return posterior_means(evidence, until_now, learns_recall, learns_decay);
}

}  // namespace understory::existence
