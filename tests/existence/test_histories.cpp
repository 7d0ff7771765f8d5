// Recall of passes and decay from what became of all points: against the posterior itself.
#include <cmath>
#include <random>
#include <vector>

#include "common/existence/histories.hpp"
#include "tests/catch.hpp"

using namespace understory::existence;

namespace {

constexpr double kYear = 365.25 * 86400.0;

struct Lived {
  int missed = 0;
  double since_s = 0.0;
  bool is_closed = false;
};

/// By a grid over all that can be, every history by itself.
LearnedRates summed_up(const std::vector<Lived>& all, const PassCounts& prior) {
  constexpr int kRecalls = 400, kRates = 400;
  double total = 0.0, recall = 0.0, rate = 0.0, offset = 0.0;
  bool is_first = true;
  for (int i = 0; i < kRecalls; ++i) {
    const double v = (i + 0.5) / kRecalls;
    for (int k = 0; k < kRates; ++k) {
      const double lambda = 1e-11 * std::exp((k + 0.5) / kRates * std::log(1e4));
      double log = (prior.seen - 1.0) * std::log(v) + (prior.missed - 1.0) * std::log(1.0 - v) +
                   prior.went * std::log(lambda) - prior.exposure_s * lambda;
      for (const Lived& one : all) {
        const double stayed = std::exp(-lambda * one.since_s);
        const double missed = std::pow(1.0 - v, one.missed);
        log += std::log(one.is_closed ? stayed * v * missed : 1.0 - stayed + stayed * missed);
      }
      if (is_first) offset = log;
      is_first = false;
      const double weight = std::exp(std::min(600.0, log - offset));
      total += weight;
      recall += weight * v;
      rate += weight * lambda;
    }
  }
  return {recall / total, rate / total};
}

LearnedRates learned(const std::vector<Lived>& all, const PassCounts& prior, bool recall = true,
                     bool decay = true) {
  PassHistories histories;
  for (const Lived& one : all)
    histories.add({.missed = static_cast<double>(one.missed),
                   .since_s = static_cast<float>(one.since_s),
                   .is_closed = one.is_closed});
  return histories.rates(prior, {0.7, prior.went / prior.exposure_s}, recall, decay);
}

const PassCounts kPrior{2.8, 1.2, 4.0, 4.0 / 8e-10};

}  // namespace

TEST_CASE("Rates are the means of their posterior", "[existence]") {
  std::vector<Lived> all;
  SECTION("one pass after years: only the product is known") {
    for (int i = 0; i < 40; ++i) all.push_back({i < 14 ? 0 : 1, 6.0 * kYear, i < 14});
  }
  SECTION("two passes") {
    for (int i = 0; i < 60; ++i) all.push_back({i % 3, 6.0 * kYear + 86400.0 * (i % 3), i % 3 < 2});
  }
  SECTION("nothing at all") {}
  const LearnedRates truth = summed_up(all, kPrior);
  const LearnedRates rates = learned(all, kPrior);
  CHECK(rates.pass_recall == Approx(truth.pass_recall).margin(0.01));
  CHECK(rates.decay_per_s == Approx(truth.decay_per_s).epsilon(0.05));
}

TEST_CASE("Thousands that two passes missed are not taken for gone", "[existence]") {
  std::mt19937_64 random(31);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double v = GENERATE(0.34, 0.64, 0.95);
  std::vector<Lived> all;
  for (int i = 0; i < 3000; ++i) {
    const bool is_there = unit(random) >= 0.05;
    Lived lived{0, 6.0 * kYear, false};
    for (int pass = 0; pass < 3; ++pass) {
      const bool is_seen = is_there && unit(random) < v;
      lived.missed += is_seen ? 0 : 1;
      lived.is_closed = is_seen;
      if (!is_seen) continue;
      all.push_back(lived);
      lived = {0, 86400.0, false};
    }
    if (!lived.is_closed) all.push_back(lived);
  }
  const LearnedRates rates = learned(all, kPrior);
  CHECK(rates.pass_recall == Approx(v).margin(0.03));
  CHECK(std::exp(-rates.decay_per_s * 6.0 * kYear) == Approx(0.95).margin(0.03));
}

TEST_CASE("What is not learned stays", "[existence]") {
  const std::vector<Lived> all(50, {2, kYear, false});
  const LearnedRates recall_told = learned(all, kPrior, false, true);
  CHECK(recall_told.pass_recall == 0.7);
  CHECK(recall_told.decay_per_s > 8e-10);
  const LearnedRates decay_told = learned(all, kPrior, true, false);
  CHECK(decay_told.decay_per_s == kPrior.went / kPrior.exposure_s);
  CHECK(decay_told.pass_recall < 0.3);
}

TEST_CASE("What was counted by the probability of then is taken out", "[existence]") {
  PassHistories plain, counted;
  plain.add({.missed = 1.0, .since_s = 1e6F});
  counted.add({.missed = 1.0,
               .since_s = 1e6F,
               .counted_missed = 0.6,
               .counted = {.went = 0.4F, .since_s = 1e6F}});
  const PassCounts with{kPrior.seen, kPrior.missed + 0.6, kPrior.went + 0.4,
                        kPrior.exposure_s + 0.6 * 1e6};
  const LearnedRates a = plain.rates(kPrior, {}, true, true);
  const LearnedRates b = counted.rates(with, {}, true, true);
  CHECK(a.pass_recall == Approx(b.pass_recall));
  CHECK(a.decay_per_s == Approx(b.decay_per_s));
}
