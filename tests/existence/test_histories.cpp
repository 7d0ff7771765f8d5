// Recall of passes and decay from what became of all points: against the posterior itself.
#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include "common/existence/histories.hpp"
#include "common/existence/pass_occluder.hpp"
#include "tests/catch.hpp"

using namespace understory::existence;

namespace {

constexpr double kDay = 86400.0;
constexpr double kYear = 365.25 * kDay;

/// Missed by the drive before, missed by this one, or seen by it.
struct Lived {
  bool missed_before = false;
  bool missed_now = false;
  double since_s = 0.0;
  int sides = 0;
  bool hidden_before = false;  ///< The drive before that missed it was hidden.
};

/// Counts of the drives and of what went, with the priors.
struct Known {
  double before_seen = 2.8, before_missed = 1.2;
  double went = 4.0, exposure_s = 4.0 / 8e-10;
};

constexpr RatePriors kPriors{2.8, 1.2, 4.0, 4.0 / 8e-10};

LearnedRates start(const Known& known) {
  LearnedRates rates;
  rates.now = rates.before = 0.7;
  rates.decay_per_s = known.went / known.exposure_s;
  rates.before_seen = known.before_seen;
  rates.before_missed = known.before_missed;
  return rates;
}

LearnedRates learned(const std::vector<Lived>& all, const Known& known, bool recall = true,
                     bool decay = true) {
  PassHistories histories;
  for (const Lived& one : all)
    histories.add({.missed_before = one.missed_before && !one.hidden_before ? 1.0 : 0.0,
                   .hidden_before = one.missed_before && one.hidden_before ? 1 : 0,
                   .missed_now = one.missed_now ? 1.0 : 0.0,
                   .sides = one.sides,
                   .is_seen_now = !one.missed_now,
                   .since_s = static_cast<float>(one.since_s),
                   .until_missed_s = static_cast<float>(one.since_s - kDay)});
  return histories.rates(start(known), kPriors, known.went, known.exposure_s, recall, decay);
}

/// Log of what a history says.
double log_chance(const Lived& one, double now, double last, double lambda) {
  const double stayed = std::exp(-lambda * one.since_s);
  if (!one.missed_before) return std::log(one.missed_now ? 1.0 - stayed * now : stayed * now);
  const double until_missed = std::exp(-lambda * (one.since_s - kDay));
  const double missed =
      one.hidden_before ? PassOccluder::missed_when_hidden(1.0 - last) : 1.0 - last;
  return std::log(one.missed_now ? 1.0 - until_missed + missed * (until_missed - stayed * now)
                                 : stayed * missed * now);
}

double beta(double v, double seen, double missed) {
  return std::exp((seen - 1.0) * std::log(v) + (missed - 1.0) * std::log(1.0 - v) +
                  std::lgamma(seen + missed) - std::lgamma(seen) - std::lgamma(missed));
}

/// v of this drive, v before, lambda, and the share that is hidden: means by a fine grid over all
/// that can be, every history by itself.
class FineGrid {
 public:
  FineGrid(const std::vector<Lived>& all, const Known& known) : all_(all), known_(known) {
    for (int k = 0; k < kShares; ++k)
      for (int l = 0; l < kRates; ++l)
        for (int i = 0; i < kShares; ++i) add(share(k), rate(l), share(i));
    for (double& mean : means_) mean /= total_;
  }
  const std::array<double, 4>& means() const { return means_; }

 private:
  static constexpr int kShares = 60, kRates = 120;
  static double share(int step) { return (step + 0.5) / kShares; }
  static double rate(int step) { return 1e-11 * std::exp((step + 0.5) / kRates * std::log(1e4)); }

  /// `any`: v of this drive where nothing hides, else the share that is hidden.
  void add(double last, double lambda, double any) {
    const double seen =
        0.95 * beta(any, 100.0 * last, 100.0 * (1.0 - last)) + 0.05 * beta(any, 2.8, 1.2);
    const double prior = (known_.before_seen - 1.0) * std::log(last) +
                         (known_.before_missed - 1.0) * std::log(1.0 - last) +
                         known_.went * std::log(lambda) - known_.exposure_s * lambda;
    double open = prior + std::log((1.0 - kPriors.hidden) * seen);
    double hidden = prior + std::log(0.95 * kPriors.hidden);
    for (const Lived& one : all_) {
      open += log_chance(one, any, last, lambda);
      hidden += log_chance(one, last * (1.0 - any * hides_all(one.sides)), last, lambda);
    }
    count(open, {any, last, lambda, 0.0});
    count(hidden, {last, last, lambda, any});
  }
  void count(double log, const std::array<double, 4>& at) {
    offset_ = offset_.value_or(log);
    const double weight = std::exp(std::min(600.0, log - *offset_));
    total_ += weight;
    for (std::size_t i = 0; i < at.size(); ++i) means_[i] += weight * at[i];
  }

  const std::vector<Lived>& all_;
  Known known_;
  std::optional<double> offset_;
  double total_ = 0.0;
  std::array<double, 4> means_{};
};

}  // namespace

TEST_CASE("Rates are the means of their posterior", "[existence]") {
  std::vector<Lived> all;
  SECTION("one drive after years: only the product is known") {
    for (int i = 0; i < 40; ++i) all.push_back({false, i >= 14, 6.0 * kYear});
  }
  SECTION("two drives") {
    for (int i = 0; i < 20; ++i) all.push_back({false, i >= 8, kDay});
    for (int i = 0; i < 20; ++i) all.push_back({true, i >= 7, 6.0 * kYear + kDay});
  }
  SECTION("two drives, the first one past a stack") {
    for (int i = 0; i < 20; ++i) all.push_back({false, i >= 16, kDay});
    for (int i = 0; i < 20; ++i) all.push_back({true, i >= 12, 6.0 * kYear + kDay, 0, i % 2 == 0});
  }
  SECTION("nothing at all") {}
  SECTION("half of what is looked at from one side is missed") {
    for (int i = 0; i < 40; ++i) all.push_back({false, i % 2 == 0, 30.0 * kDay, 1});
    for (int i = 0; i < 40; ++i) all.push_back({false, i % 10 == 0, 30.0 * kDay, 2 + i % 2});
  }
  const FineGrid grid(all, {});
  const auto& truth = grid.means();
  const LearnedRates rates = learned(all, {});
  CHECK(rates.hidden == Approx(truth[3]).margin(0.015));
  CHECK(rates.now == Approx(truth[0]).margin(0.015));
  CHECK(rates.before == Approx(truth[1]).margin(0.015));
  CHECK(rates.decay_per_s == Approx(truth[2]).epsilon(0.06));
}

TEST_CASE("Thousands that two drives missed are not taken for gone", "[existence]") {
  std::mt19937_64 random(31);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double last = GENERATE(0.34, 0.9);
  const double now = GENERATE(0.34, 0.64);
  std::vector<Lived> all;
  Known known;
  for (int i = 0; i < 3000; ++i) {
    const bool is_there = unit(random) >= 0.05;
    const bool missed_last = !is_there || unit(random) >= last;
    const bool missed_now = !is_there || unit(random) >= now;
    known.before_seen += missed_last ? 0.0 : 1.0;
    known.exposure_s += missed_last ? 0.0 : 6.0 * kYear;
    all.push_back({missed_last, missed_now, missed_last ? 6.0 * kYear : kDay});
  }
  const LearnedRates rates = learned(all, known);
  CHECK(rates.now == Approx(now).margin(0.05));
  CHECK(rates.before == Approx(last).margin(0.06));
  CHECK(std::exp(-rates.decay_per_s * 6.0 * kYear) == Approx(0.95).margin(0.08));
}

TEST_CASE("A drive that misses more than the one before takes nothing for gone", "[existence]") {
  // All were seen by the last drive, a month ago; a third is missed now.
  std::vector<Lived> all;
  all.reserve(300);
  for (int i = 0; i < 300; ++i) all.push_back({false, i % 3 == 0, 30.0 * kDay});
  Known known;
  known.before_seen = 300.0;
  const LearnedRates rates = learned(all, known);
  CHECK(rates.now == Approx(0.7).margin(0.05));
  CHECK(rates.before > 0.98);
}

TEST_CASE("What is not learned stays", "[existence]") {
  const std::vector<Lived> all(50, {true, true, kYear});
  const LearnedRates recall_told = learned(all, {}, false, true);
  CHECK(recall_told.now == 0.7);
  CHECK(recall_told.before == 0.7);
  CHECK(recall_told.decay_per_s > 8e-10);
  const LearnedRates decay_told = learned(all, {}, true, false);
  CHECK(decay_told.decay_per_s == start({}).decay_per_s);
  CHECK(decay_told.now < 0.4);
}

TEST_CASE("What was counted by the probability of then is taken out", "[existence]") {
  PassHistories plain, counted;
  OpenHistory history{.missed_now = 1.0, .since_s = 1e6F};
  plain.add(history);
  history.counted = {.went = 0.4F, .since_s = 1e6F};
  counted.add(history);
  const Known known;
  const LearnedRates a =
      plain.rates(start(known), kPriors, known.went, known.exposure_s, true, true);
  const LearnedRates b = counted.rates(start(known), kPriors, known.went + 0.4,
                                       known.exposure_s + 0.6 * 1e6, true, true);
  CHECK(a.now == Approx(b.now));
  CHECK(a.decay_per_s == Approx(b.decay_per_s));
}
