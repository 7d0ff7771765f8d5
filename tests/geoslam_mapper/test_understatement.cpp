#include "services/geoslam_mapper/smoothing/understatement.hpp"

#include <algorithm>
#include <random>
#include <vector>

#include "tests/catch.hpp"

using namespace understory::geoslam_mapper::smoothing;

TEST_CASE("Understatement is that of a list of metres", "[closures]") {
  std::mt19937_64 random(1);
  std::uniform_int_distribution<int> metre(0, 59);
  for (int trial = 0; trial < 200; ++trial) {
    Understatement understated;
    std::vector<double> expected(60, 1.0);
    for (int step = 0; step < 6; ++step) {
      const auto [from, to] = std::minmax({metre(random), metre(random)});
      const double factor = 1.0 + static_cast<double>(random() % 100);
      understated.raise(from, to, factor);
      for (int i = from; i <= to; ++i) {
        double& one = expected[static_cast<std::size_t>(i)];
        one = std::max(one, factor);
      }
    }

    for (int i = 0; i < 60; ++i) CHECK(understated.at(i) == expected[static_cast<std::size_t>(i)]);
    const auto [from, to] = std::minmax({metre(random), metre(random)});
    // Between two metres it may be that of neither.
    double least = 1e9;
    for (double at = from; at <= to; at += 0.25) least = std::min(least, understated.at(at));
    CHECK(understated.least(from, to) == least);
  }
}
