// Stretches on which the pose was wrong, and whether a process said so in time.
#include "deploy/cli/wrong_stretches.hpp"

#include "tests/catch.hpp"
#include "tests/cli/made_up_run.hpp"

using namespace understory;
using namespace understory::test;
using geometry::SE2;

namespace {

/// 200 s at rest. The pose is exact but between the seconds given, where it is 5 m off and says
/// 10 cm.
MadeUpRun standing_run(const std::vector<std::pair<double, double>>& wrong) {
  MadeUpRun run;
  for (int i = 0; i <= 2000; ++i) {
    const double seconds = 0.1 * i;
    run.truth(seconds, {});
    if (i == 0) run.update(0.0, {}, model::MapUpdateStatus::kFirstMap);
    double off_m = 0.0;
    for (const auto& [from, to] : wrong)
      if (seconds >= from && seconds <= to) off_m = 5.0;
    run.pose(seconds, SE2(0.0, off_m, 0.0), 0.01 * Eigen::Matrix3d::Identity());
  }
  return run;
}

std::vector<bool> told(const MadeUpRun& run) {
  std::vector<bool> result;
  const auto accuracy = run.accuracy();
  for (const auto& stretch : accuracy->wrong_stretches) result.push_back(stretch.was_told);
  return result;
}

}  // namespace

TEST_CASE("A pose is wrong where it is far off and says that it is not", "[cli]") {
  const auto wrong = [](double off_m, double sigma_m) {
    const Eigen::Matrix3d covariance = sigma_m * sigma_m * Eigen::Matrix3d::Identity();
    return cli::is_wrong(
        {0, SE2(3.0, 4.0, 1.0) * SE2(off_m, 0.0, 0.0), SE2(3.0, 4.0, 1.0), covariance});
  };
  CHECK_FALSE(wrong(0.9, 0.01));
  CHECK(wrong(1.1, 0.01));
  CHECK(wrong(1.1, 0.0));
  CHECK_FALSE(wrong(1.1, 1.0));
  // 3.439 sigma is where two degrees of freedom are exceeded in 0.27 % of the cases.
  CHECK_FALSE(wrong(3.43, 1.0));
  CHECK(wrong(3.45, 1.0));
}

TEST_CASE("Wrong poses within ten seconds are one stretch", "[cli]") {
  const auto stretches =
      standing_run({{10.0, 12.0}, {21.5, 22.0}, {40.0, 50.0}}).accuracy()->wrong_stretches;
  REQUIRE(stretches.size() == 2);
  CHECK(stretches[0].span.from_us == MadeUpRun::at(10.0));
  CHECK(stretches[0].span.to_us == MadeUpRun::at(22.0));
  CHECK(stretches[0].poses == 27);
  CHECK(stretches[1].largest_error_m == Approx(5.0));
  CHECK_FALSE(stretches[1].was_told);
}

TEST_CASE("HEALTH tells of a stretch from its start to ten seconds later", "[cli]") {
  using Wrong = std::vector<std::pair<double, double>>;
  const Wrong wrong{{30.0, 60.0}, {100.0, 100.5}};
  for (const std::int8_t bad : {health_t::STATE_DEGRADED, health_t::STATE_ERROR}) {
    for (int second = 20; second < 55; ++second) {
      CAPTURE(second);
      auto run = standing_run(wrong);
      run.health(0.5, "keyframer", health_t::STATE_OK);
      run.health(second + 0.3, "mapper", bad);
      run.health(120.0, "mapper", bad);
      CHECK(told(run) == std::vector<bool>{second >= 29 && second < 40, false});
    }
  }
  auto run = standing_run(wrong);
  run.health(31.0, "mapper", health_t::STATE_STARTING);
  run.health(31.0, "mapper", health_t::STATE_OK);
  CHECK(told(run) == std::vector<bool>{false, false});
}

TEST_CASE("Without HEALTH a process is judged by its LOG", "[cli]") {
  const std::int8_t warning = log_t::LEVEL_WARNING;
  const std::int8_t info = log_t::LEVEL_INFO;
  const auto run_with = [&](double from, double to, const std::string& code) {
    auto run = standing_run({{30.0, 60.0}, {100.0, 101.0}});
    run.log(from, "mapper", warning, code, "it is not well");
    if (to > 0.0) run.log(to, "mapper", info, code, "it is not well: over");
    return run;
  };
  CHECK(told(run_with(10.0, 31.0, "lost")) == std::vector<bool>{true, false});
  CHECK(told(run_with(10.0, 29.0, "lost")) == std::vector<bool>{false, false});
  CHECK(told(run_with(41.0, 120.0, "lost")) == std::vector<bool>{false, true});
  // Never over: a condition holds, a single fault does not.
  CHECK(told(run_with(10.0, 0.0, "lost")) == std::vector<bool>{true, true});
  CHECK(told(run_with(10.0, 0.0, "late")) == std::vector<bool>{false, false});
  CHECK(told(run_with(28.0, 0.0, "late")) == std::vector<bool>{true, false});

  // Its HEALTH counts where there is any.
  auto run = run_with(10.0, 0.0, "lost");
  run.health(31.0, "mapper", health_t::STATE_OK);
  CHECK(told(run) == std::vector<bool>{false, false});
  CHECK_FALSE(standing_run({}).accuracy()->has_alarms);
}
