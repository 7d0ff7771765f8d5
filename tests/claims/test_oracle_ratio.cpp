// How near the map comes to the best map that the same detections allow.
#include <atomic>

#include "eval/harness/campaign.hpp"
#include "eval/harness/summary.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval::harness;

TEST_CASE("the pose error is within a few percent of the maximum-likelihood oracle's", "[claims]") {
  // Circle of 200 m in the intermediate forest, 20 cm noise per axis, 90 % detection.
  const Cell cell;
  CampaignOptions options;
  // Three runs would scatter from 0.92 to 1.24.
  options.runs = 10;
  options.seed = 1;
  options.methods = {"smoothing", "oracle"};
  const std::atomic<bool> stop{false};

  const std::vector<Summary> rows = summarise(run_campaign({cell}, options, stop), options.methods);

  const Summary& smoothing = rows.at(0);
  REQUIRE(smoothing.method == "smoothing");
  CAPTURE(smoothing.ratio, smoothing.ratio_lpe, smoothing.rpe_cm.mean, smoothing.lpe_cm.mean);
  CHECK(smoothing.ratio < 1.10);
  CHECK(smoothing.ratio_lpe < 1.15);
  // Below 1 the comparison itself is wrong: nothing beats the oracle on the average of ten runs.
  CHECK(smoothing.ratio > 0.98);
  CHECK(smoothing.wrong_updates == 0);
  CHECK(smoothing.updates == smoothing.updates_possible);
}
