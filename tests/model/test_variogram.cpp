#include "common/model/variogram.hpp"

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "tests/catch.hpp"

using namespace understory;

namespace {

constexpr std::array<std::size_t, 5> kLags = {1, 2, 4, 8, 16};

/// An AR(1) process of unit variance.
std::vector<double> process(double correlation, std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> values{normal(random)};
  while (values.size() < count)
    values.push_back(correlation * values.back() +
                     std::sqrt(1.0 - correlation * correlation) * normal(random));
  return values;
}

/// Variogram of a process at kLags, over its value at lag 4.
std::vector<model::LagVariance> variogram(const std::vector<double>& values) {
  std::vector<model::LagVariance> lags;
  for (const std::size_t lag : kLags) {
    double sum = 0.0;
    for (std::size_t i = lag; i < values.size(); ++i)
      sum += 0.5 * (values[i] - values[i - lag]) * (values[i] - values[i - lag]);
    const auto count = static_cast<double>(values.size() - lag);
    lags.push_back({lag, sum / count, count});
  }
  return lags;
}

}  // namespace

TEST_CASE("White noise has the power of its variance", "[variogram]") {
  int inflated = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const double power = model::white_noise_power(variogram(process(0.0, 2000, seed)), 4, 4.0);
    CAPTURE(seed, power);
    CHECK(power > 0.99);
    CHECK(power < 1.3);
    if (power > 1.0 + 1e-9) ++inflated;
  }
  CHECK(inflated <= 4);
}

TEST_CASE("Correlated noise has the power of its spectrum at frequency zero", "[variogram]") {
  for (const double correlation : {0.3, 0.5, 0.6, 0.7, 0.75}) {
    double mean = 0.0;
    constexpr int kSeeds = 50;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed)
      mean +=
          model::white_noise_power(variogram(process(correlation, 8000, seed)), 4, 3.0) / kSeeds;
    const double variance_at_lag = 1.0 - std::pow(correlation, 4);
    const double exact = (1.0 + correlation) / (1.0 - correlation) / variance_at_lag;
    CAPTURE(correlation, mean, exact);
    CHECK(mean > 0.8 * exact);
    CHECK(mean < 1.15 * exact);
  }
}

TEST_CASE("The mean of many correlated values is as uncertain as the power says", "[variogram]") {
  constexpr double kCorrelation = 0.7;
  constexpr std::size_t kCount = 400;
  double squares = 0.0;
  constexpr int kSeeds = 2000;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    double mean = 0.0;
    for (const double value : process(kCorrelation, kCount, seed)) mean += value / kCount;
    squares += mean * mean / kSeeds;
  }
  const auto lags = variogram(process(kCorrelation, 200'000, 7));
  const double power = lags[2].value * model::white_noise_power(lags, 4, 3.0);
  CHECK(squares * kCount == Approx(power).epsilon(0.15));
}

TEST_CASE("A variogram of which nothing is known has the power 1", "[variogram]") {
  CHECK(model::white_noise_power({}, 4, 3.0) == 1.0);
  const std::array<model::LagVariance, 1> only{{{1, 0.5, 1000.0}}};
  CHECK(model::white_noise_power(only, 4, 3.0) == 1.0);
  const std::array<model::LagVariance, 2> empty{{{1, 0.5, 0.0}, {4, 1.0, 0.0}}};
  CHECK(model::white_noise_power(empty, 4, 3.0) == 1.0);
}

TEST_CASE("Errors that fade slowly outlast the lags, however few of these are known",
          "[variogram]") {
  constexpr double kDegrees = 2000.0;
  for (std::size_t known = 2; known <= kLags.size(); ++known) {
    std::vector<model::LagVariance> white;
    std::vector<model::LagVariance> slow;
    for (std::size_t i = 0; i < kLags.size(); ++i) {
      const double degrees = i < known ? kDegrees : 0.0;
      white.push_back({kLags[i], 1.0, degrees});
      slow.push_back({kLags[i], static_cast<double>(kLags[i]) / 4.0, degrees});
    }
    CAPTURE(known);
    CHECK_FALSE(model::outlasts(white, 0.15));
    CHECK(model::outlasts(slow, 0.15));
  }
  CHECK_FALSE(model::outlasts({}, 0.15));
}
