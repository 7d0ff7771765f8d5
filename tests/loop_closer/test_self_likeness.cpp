// Stems in rows fit themselves a few metres on; those of a forest do not.
#include "services/loop_closer/self_likeness.hpp"

#include <cmath>
#include <random>
#include <vector>

#include "tests/catch.hpp"

using namespace understory::loop_closer;
using understory::place_recognition::LevelStem;
using understory::place_recognition::StemNoise;

namespace {

constexpr double kRange_m = 18.0;

/// Rows 4 m apart with a tree every 2.5 m, each off by `sigma_m` per axis, turned by an angle.
std::vector<LevelStem> stems_in_rows(double sigma_m, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const double turn = 6.28 * uniform(random);
  std::vector<LevelStem> stems;
  for (double x = -30.0; x < 30.0; x += 2.5) {
    for (double y = -30.0; y < 30.0; y += 4.0) {
      const double dx = x + sigma_m * normal(random), dy = y + sigma_m * normal(random);
      if (std::hypot(dx, dy) > kRange_m || uniform(random) > 0.9) continue;
      const double diameter_m = 0.24 * std::exp(0.15 * normal(random));
      stems.push_back(
          {{std::cos(turn) * dx - std::sin(turn) * dy, std::sin(turn) * dx + std::cos(turn) * dy},
           diameter_m});
    }
  }
  return stems;
}

std::vector<LevelStem> stems_anywhere(std::size_t count, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> metres(-kRange_m, kRange_m);
  std::vector<LevelStem> stems;
  while (stems.size() < count) {
    const double x = metres(random), y = metres(random);
    if (std::hypot(x, y) <= kRange_m)
      stems.push_back({{x, y}, 0.24 * std::exp(0.4 * normal(random))});
  }
  return stems;
}

}  // namespace

TEST_CASE("Rows are like themselves, the more the straighter they are", "[loop_closer]") {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 10; ++trial) {
    const double exact = self_likeness(stems_in_rows(0.02, random), {});
    const double usual = self_likeness(stems_in_rows(0.15, random), {});
    CAPTURE(trial, exact, usual);
    CHECK(exact > 40.0);
    CHECK(usual > 15.0);
    CHECK(exact > usual);
  }
}

TEST_CASE("A forest is not like itself", "[loop_closer]") {
  std::mt19937_64 random(2);
  for (int trial = 0; trial < 40; ++trial) {
    const double likeness = self_likeness(stems_anywhere(10 + 10 * (trial % 8), random), {});
    CAPTURE(trial, likeness);
    CHECK(likeness < 7.0);
  }
  CHECK(self_likeness({}, {}) == 0.0);
}
