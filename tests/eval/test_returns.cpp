// A drive that drifts and comes back near itself.
#include <random>

#include "eval/experiments/returns/returns.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval::experiments;

TEST_CASE("What comes into view again after a drift is joined, and nothing else", "[returns]") {
  sim::ForestParameters parameters = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.side_m = 130.0;
  int merges = 0;
  int doubled = 0;
  int joined = 0;
  double nees = 0.0;
  for (const std::uint64_t seed : {11U, 12U, 13U, 14U}) {
    std::mt19937_64 random(seed);
    const sim::Forest forest = sim::make_forest(parameters, random);
    returns::ReturnDrive drive;
    drive.drift_m = 8.0;
    const returns::ReturnScore score = returns::drive(drive, forest, seed);

    INFO("seed " << seed << ", drift " << score.drift_m << " m, merges " << score.merges);
    CHECK(score.false_merges == 0);
    CHECK(score.refused <= score.keyframes / 50);
    CHECK(score.last_error_m < 0.2);
    nees += 0.25 * score.mean_nees;
    merges += score.merges;
    doubled += score.doubled;
    joined += score.joined;
  }
  INFO(joined << " of " << doubled << " joined in " << merges << " merges");
  CHECK(nees < 6.0);
  REQUIRE(doubled >= 10);
  CHECK(joined >= 0.8 * doubled);
}
