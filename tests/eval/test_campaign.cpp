#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>

#include "common/terminal/interrupt.hpp"
#include "eval/harness/campaign.hpp"
#include "eval/harness/results.hpp"
#include "eval/harness/summary.hpp"
#include "eval/tools/parallel.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval;

namespace {

nlohmann::json rows_with(int jobs) {
  eval::harness::Cell cell;
  cell.forest = sim::ForestKind::kSparse;
  cell.interval_m = 1.0;  // a fifth of the scans
  eval::harness::CampaignOptions options;
  options.runs = 3;
  options.jobs = jobs;
  options.methods = {"smoothing", "oracle"};
  const std::atomic<bool> stop{false};
  nlohmann::json rows = nlohmann::json::array();
  for (const eval::harness::Summary& row :
       summarise(run_campaign({cell}, options, stop), options.methods)) {
    rows.push_back(to_json(row));
  }
  return rows;
}

}  // namespace

TEST_CASE("Results do not depend on the number of jobs", "[campaign]") {
  const nlohmann::json rows = rows_with(1);
  CHECK(rows == rows_with(3));
  REQUIRE(rows.size() == 2);
  CHECK(rows[1]["method"] == "oracle");
  CHECK(rows[1]["updates"] == 25);
  CHECK(rows[1]["interval_cm"] == 100.0);
  CHECK(rows[1]["errors"] == "independent");
  CHECK(rows[0]["runs_with_new_maps"] == 0);
  CHECK(rows[1]["ratio"].get<double>() == 1.0);
  for (const char* key :
       {"path", "forest", "sigma_cm", "detection_pct", "interval_cm", "rpe_cm", "lpe_cm", "ratio",
        "ratio_lpe", "updates", "updates_possible", "wrong_updates"}) {
    CHECK(rows[0].contains(key));
  }
}

TEST_CASE("Shared errors have the power of independent ones, last from scan to scan and are stated",
          "[campaign]") {
  eval::harness::Cell cell;
  cell.forest = sim::ForestKind::kSparse;
  for (const harness::Errors errors :
       {harness::Errors::kIndependent, harness::Errors::kShared, harness::Errors::kSharedWide}) {
    cell.errors = errors;
    CHECK(harness::errors_named(to_string(errors)) == errors);
    const bool is_shared = errors != harness::Errors::kIndependent;
    const double stated_m = (errors == harness::Errors::kSharedWide ? 3.0 : 1.0) * cell.sigma_m;
    const eval::harness::RecordedDrive recorded(cell.drive(), 5);
    std::map<std::uint32_t, Eigen::Vector2d> before;
    double squares = 0.0, products = 0.0;
    int detections = 0, pairs = 0;
    for (const sim::SimulatedScan& scan : recorded.scans) {
      std::map<std::uint32_t, Eigen::Vector2d> now;
      for (std::size_t i = 0; i < scan.trunks.size(); ++i) {
        const model::Detection& detection = scan.scan.detections[i];
        CHECK(detection.covariance_m2(0, 0) == Approx(stated_m * stated_m));
        const Eigen::Vector2d seen_m =
            scan.world_T_vehicle * Eigen::Vector2d(detection.position_m.head<2>());
        const Eigen::Vector2d error_m = seen_m - recorded.drive.forest().trunks_m[scan.trunks[i]];
        now[scan.trunks[i]] = error_m;
        squares += error_m.squaredNorm();
        ++detections;
        if (const auto found = before.find(scan.trunks[i]); found != before.end()) {
          products += error_m.dot(found->second);
          ++pairs;
        }
      }
      before = std::move(now);
    }

    REQUIRE(pairs > 1000);
    const double variance = squares / (2.0 * detections);
    CHECK(variance == Approx(cell.sigma_m * cell.sigma_m).epsilon(0.2));
    CHECK(products / (2.0 * pairs) / variance == Approx(is_shared ? 0.95 : 0.0).margin(0.05));
  }
}

TEST_CASE("The figure of matches shows what a method matched, polygons where it matches them",
          "[campaign]") {
  eval::harness::Cell cell;
  cell.forest = sim::ForestKind::kSparse;
  cell.interval_m = 1.0;
  eval::harness::CampaignOptions options;
  options.runs = 1;
  options.methods = {"baseline", "smoothing"};
  const std::atomic<bool> stop{false};
  const auto cells = run_campaign({cell}, options, stop);
  const nlohmann::json traces = traces_of(cells, options);

  const nlohmann::json& methods = traces.at(0).at("methods");
  const nlohmann::json& smoothing = methods.at("smoothing").at("snapshot");
  CHECK_FALSE(smoothing.contains("first_associations"));
  CHECK_FALSE(smoothing.contains("map_polygons"));
  CHECK(smoothing.at("filtered_associations").size() > 3);
  const auto& update = cells.at(0).runs.at("smoothing").front().trace.snapshot->update;
  CHECK(smoothing.at("filtered_associations").size() <= update.associations.size());
  if (methods.at("baseline").contains("snapshot"))
    CHECK(methods.at("baseline").at("snapshot").contains("first_associations"));
}

TEST_CASE("Every job runs once; exceptions and stops come through", "[parallel]") {
  std::atomic<bool> stop{false};
  std::mutex mutex;
  std::multiset<std::size_t> calls;
  eval::tools::run_in_parallel(100, 4, "jobs", stop, [&](std::size_t i) {
    const std::scoped_lock lock(mutex);
    calls.insert(i);
  });
  CHECK(calls.size() == 100);
  CHECK(std::set<std::size_t>(calls.begin(), calls.end()).size() == 100);

  CHECK_THROWS_WITH(eval::tools::run_in_parallel(10, 3, "jobs", stop,
                                                 [](std::size_t i) {
                                                   if (i == 4) throw std::runtime_error("job four");
                                                 }),
                    "job four");
  CHECK_THROWS_AS(
      eval::tools::run_in_parallel(10, 2, "jobs", stop, [&](std::size_t) { stop = true; }),
      terminal::Interrupted);
}

TEST_CASE("Statistics and chi^2 bands", "[summary]") {
  const eval::harness::Statistics s = eval::harness::statistics_of({1.0, 2.0, 3.0, 4.0});
  CHECK(s.mean == Approx(2.5));
  CHECK(s.standard_deviation == Approx(1.2909944));
  CHECK(eval::harness::statistics_of({7.0}).standard_deviation == 0.0);
  // Tables of the chi^2 distribution, 10 and 300 degrees of freedom.
  CHECK(eval::harness::chi2_band_95(10).first == Approx(3.247).epsilon(0.01));
  CHECK(eval::harness::chi2_band_95(10).second == Approx(20.483).epsilon(0.005));
  CHECK(eval::harness::chi2_band_95(300).first == Approx(253.91).epsilon(0.001));
  CHECK(eval::harness::chi2_band_95(300).second == Approx(349.87).epsilon(0.001));
}

TEST_CASE("Unknown methods are refused", "[methods]") {
  CHECK_THROWS_AS(eval::harness::make_stages("theirs"), std::invalid_argument);
}

TEST_CASE("Result files are written whole or not at all", "[results]") {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / "understory_test_results";
  fs::remove_all(folder);
  fs::create_directory(folder);
  const fs::path file = folder / "a.json";

  eval::harness::write_json(
      file, eval::harness::result_document("paths", {{"runs", 1}}, nlohmann::json::array()));
  nlohmann::json read;
  std::ifstream(file) >> read;
  for (const char* key : {"experiment", "config", "rows", "machine", "version", "date"}) {
    CHECK(read.contains(key));
  }

  CHECK(eval::harness::traces_file(file) == folder / "a.traces.json");

  // A directory has the name of the file: nothing is left behind.
  fs::create_directories(folder / "b.json" / "full");
  CHECK_THROWS_AS(eval::harness::write_json(folder / "b.json", read), std::runtime_error);
  CHECK_THROWS_AS(eval::harness::write_json(folder / "no" / "such.json", read), std::runtime_error);
  CHECK(std::distance(fs::directory_iterator(folder), fs::directory_iterator()) == 2);
  fs::remove_all(folder);
}
