// A surveyed forest through keyframer, mapper and tracker.
#include <set>

#include "eval/experiments/existence/census/census_drive.hpp"
#include "eval/experiments/existence/census/census_run.hpp"
#include "eval/experiments/existence/census/landmark_stems.hpp"
#include "eval/experiments/existence/scores.hpp"
#include "eval/harness/drive_map.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval;
using namespace understory::eval::experiments::existence;
using namespace understory::eval::experiments::existence::census;

namespace {

/// A plot of 100 m by 60 m with 250 stems, every tenth of which goes; some come.
std::vector<CensusStem> small_plot() {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<float> x(0.0F, 100.0F), y(0.0F, 60.0F);
  std::vector<CensusStem> stems;
  while (stems.size() < 250) {
    CensusStem stem{.place_m = {x(random), y(random)}, .radius_m = 0.15F};
    stem.is_gone = stems.size() % 10 == 0;
    stem.is_new = stems.size() % 25 == 1;
    const bool is_alone = std::none_of(stems.begin(), stems.end(), [&](const CensusStem& other) {
      return (other.place_m - stem.place_m).norm() < 1.5F;
    });
    if (is_alone) stems.push_back(stem);
  }
  return stems;
}

CensusOptions small_options() {
  CensusOptions options;
  options.config_dir = UNDERSTORY_SOURCE_CONFIG "/lidar";
  options.forest.scan_every_m = 0.5;
  options.forest.drives = 3;
  options.forest.pass_missed = 0.2;
  return options;
}

}  // namespace

TEST_CASE("lanes there and back are one way without jumps", "[existence]") {
  const std::vector<CensusStem> stems = small_plot();
  const ForestSetting setting = small_options().forest;
  const auto path = lanes_there_and_back(stems, setting, 3.0);
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Eigen::Vector3d step = (path[i - 1].inverse() * path[i]).Log();
    REQUIRE(step.head<2>().norm() < 0.6);
    REQUIRE(std::abs(step.z()) < 0.1);
  }
  CHECK(path.back().y() > 60.0 - 2.0 * setting.lane_m);
}

TEST_CASE("a drive's messages are its looks, and what stands stops the beams", "[existence]") {
  const std::vector<CensusStem> stems = small_plot();
  const ForestSetting setting = small_options().forest;
  std::mt19937_64 random(6);
  const StemGrid grid(stems, setting.range_m);
  ForestDrive looks(stems, grid, setting, true, random);
  const auto path = lanes_there_and_back(stems, setting, 3.0);
  CensusDrive drive(looks, path, 1'000'000, CensusErrors{}, 6, 6, random);
  std::size_t seen = 0;
  for (std::size_t i = 0; const auto scan = drive.next(setting.range_m); ++i) {
    REQUIRE(scan->stems.size() == scan->landmarks.detections.size());
    seen += scan->stems.size();
    for (const StemInView& one : looks.view()) {
      const Eigen::Vector2d place_m =
          path[i].inverse() * Eigen::Vector2d(stems[one.stem].place_m.cast<double>());
      const auto sight = line_of_sight(scan->view, place_m, 0.15);
      if (looks.stands(one.stem)) REQUIRE(sight != model::LineOfSight::kClear);
    }
  }
  const DriveLooks all = looks.finish(0.0);
  CHECK(seen == static_cast<std::size_t>(
                    std::count_if(all.looks.begin(), all.looks.end(),
                                  [](const LookEvent& event) { return event.is_seen; })));
}

TEST_CASE("a landmark is the stem of most of its detections, also when two become one",
          "[existence]") {
  LandmarkStems names;
  names.add(10, {7, 8, 7});
  model::MapUpdate update;
  update.scans = {{10, 0}};
  update.detections = {{0, 0, 100}, {0, 1, 101}, {0, 2, 100}};
  names.count(update);
  CHECK(names.of(100) == 7U);
  CHECK(names.of(101) == 8U);
  CHECK_FALSE(names.of(102));
  update.detections.clear();
  update.merged = {{100, 101}};
  names.count(update);
  CHECK(names.of(101) == 7U);
  CHECK_FALSE(names.of(100));
}

TEST_CASE("stems that went leave use by drives through the processes, those that stand stay",
          "[existence]") {
  const std::vector<CensusStem> stems = small_plot();
  for (const bool use_ranges : {false, true}) {
    const harness::MapFolder folder("test-census");
    CensusOptions options = small_options();
    options.use_ranges = use_ranges;
    const CensusRun run = run_census(stems, options, 7, folder.path(), [](double) {});
    REQUIRE(run.after.size() == 4);
    const CensusAfterDrive& first = run.after.front();
    CHECK(first.stems.size() > 150);
    CHECK(first.doubles_in_use <= 2);

    std::vector<ScoredPoint> points;
    for (const MappedStem& one : run.after.back().stems)
      points.push_back({one.probability, stems[one.stem].stands(true)});
    const auto& last = run.after.back();
    CAPTURE(use_ranges, roc_area(points), last.placed, last.updates, last.doubles_in_use);
    CHECK(roc_area(points) > 0.95);
    CHECK(last.placed > 0.9 * static_cast<double>(last.updates));
    CHECK(last.doubles_in_use <= 5);
    CHECK(last.recruits_in_use >= 5);
    CHECK(std::count_if(last.stems.begin(), last.stems.end(), [&](const MappedStem& one) {
            return stems[one.stem].stands(true) && !one.is_in_use;
          }) <= 0.05 * static_cast<double>(last.stems.size()));
  }
}
