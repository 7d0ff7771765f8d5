// The experiment on existence: scores by hand, peers against brute force, worlds.
#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "eval/experiments/existence/census/census_drive.hpp"
#include "eval/experiments/existence/csv.hpp"
#include "eval/experiments/existence/forest.hpp"
#include "eval/experiments/existence/observer.hpp"
#include "eval/experiments/existence/peers/joint_persistence.hpp"
#include "eval/experiments/existence/peers/log_odds_counter.hpp"
#include "eval/experiments/existence/peers/perpetua.hpp"
#include "eval/experiments/existence/peers/persistence_filter.hpp"
#include "eval/experiments/existence/protocol.hpp"
#include "eval/experiments/existence/scores.hpp"
#include "eval/experiments/existence/worlds.hpp"
#include "tests/catch.hpp"
#include "tests/data.hpp"

using namespace understory;
using namespace understory::eval::experiments::existence;

TEST_CASE("Scores of existence by hand", "[existence]") {
  const std::vector<ScoredPoint> points{{0.1, false}, {0.3, true}, {0.3, false}, {0.9, true}};
  // Pairs: 0.1 before both; 0.3 ties with one, before the other.
  CHECK(roc_area(points) == Approx((2.0 + 1.5) / 4.0));
  CHECK(brier_score(points) == Approx((0.01 + 0.49 + 0.09 + 0.01) / 4.0));
  CHECK(average_precision(points) == Approx(0.5 * 1.0 + 0.5 * 2.0 / 3.0));
  CHECK(found_at(points, 0.0) == Approx(0.5));
  CHECK(found_at(points, 0.25) == Approx(0.75));
  CHECK(found_at(points, 0.5) == Approx(1.0));
  CHECK(removed_share(points, false) == Approx(0.5));
  CHECK(removed_share(points, true) == Approx(0.0));
  CHECK(roc_area({{0.5, true}}) == 1.0);
}

TEST_CASE("The sigma of an area is that of many draws", "[existence]") {
  // Scores of two exponentials: what Hanley and McNeil's formula is exact for.
  const double faster = 4.0;
  const int gone = 20, there = 30, draws = 4000;
  std::mt19937_64 random(5);
  std::exponential_distribution<double> slow(1.0), fast(faster);
  double sum = 0.0, squares = 0.0;
  for (int i = 0; i < draws; ++i) {
    std::vector<ScoredPoint> points;
    for (int k = 0; k < gone; ++k) points.push_back({-slow(random), false});
    for (int k = 0; k < there; ++k) points.push_back({-fast(random), true});
    const double area = roc_area(points);
    sum += area;
    squares += area * area;
  }

  const double mean = sum / draws;
  CHECK(mean == Approx(faster / (1.0 + faster)).margin(0.005));
  CHECK(sigma_of_area(mean, gone, there) ==
        Approx(std::sqrt(squares / draws - mean * mean)).epsilon(0.05));
}

TEST_CASE("The persistence filter is Bayes' rule over the time of going", "[existence]") {
  const double rate = 0.3, missed = 0.2, false_rate = 0.05;
  const std::vector<std::pair<double, bool>> outputs{
      {0.5, true}, {1.0, false}, {2.0, true}, {3.5, false}, {4.0, false}};
  peers::PersistenceFilter filter(rate, 0.0);
  for (const auto& [time_s, is_seen] : outputs) filter.observe(time_s, is_seen, missed, false_rate);
  // Riemann sum over the time of going.
  double there = 0.0, all = 0.0;
  const double step = 1e-4, now = 4.5;
  for (double gone = 0.5 * step; gone < 60.0; gone += step) {
    double p = rate * std::exp(-rate * gone) * step;
    for (const auto& [time_s, is_seen] : outputs) {
      const bool exists = gone >= time_s;
      const double seen = exists ? 1.0 - missed : false_rate;
      p *= is_seen ? seen : 1.0 - seen;
    }
    all += p;
    if (gone > now) there += p;
  }
  CHECK(filter.predict(now) == Approx(there / all).epsilon(1e-3));
  CHECK(filter.log_evidence() == Approx(std::log(all)).epsilon(1e-3));
}

TEST_CASE("Perpetua goes, emerges, and learns rates by EM", "[existence]") {
  const peers::RateMixture persistence{{0.01, 0.1}, {0.5, 0.5}};
  const peers::RateMixture emergence{{0.05}, {1.0}};
  peers::Perpetua feature(persistence, emergence, 0.0);
  for (int k = 1; k <= 5; ++k) feature.update(k, true, 0.1, 0.05);
  CHECK(feature.predict(5.0) > 0.95);
  for (int k = 6; k <= 12; ++k) feature.update(k, false, 0.1, 0.05);
  CHECK(feature.predict(12.0) < 0.2);
  for (int k = 13; k <= 20; ++k) feature.update(k, true, 0.1, 0.05);
  CHECK(feature.predict(20.0) > 0.8);

  // Features that go at 0.2 per unit of time, seen without error at every unit.
  std::mt19937_64 random(1);
  std::exponential_distribution<double> survival(0.2);
  std::vector<std::vector<peers::SightingsOfDrive>> features;
  for (int i = 0; i < 2000; ++i) {
    const double gone = survival(random);
    std::vector<peers::SightingsOfDrive> drives;
    for (int k = 0; k <= 20; ++k)
      drives.push_back({static_cast<double>(k), gone > k ? 0.0 : -30.0, gone > k ? -30.0 : 0.0});
    features.push_back(drives);
  }
  peers::RateMixture mixture{{1.0}, {1.0}};
  for (int step = 0; step < 50; ++step) mixture = peers::em_step(mixture, features);
  CHECK(mixture.rates_per_s[0] == Approx(0.2).epsilon(0.05));
}

TEST_CASE("Coupled neighbours agree more", "[existence]") {
  const std::vector<Eigen::Vector3f> points{{0, 0, 0}, {1, 0, 0}, {50, 0, 0}};
  const auto neighbours = peers::neighbours_of(points, 4, 5.0F);
  CHECK(neighbours[0] == std::vector<std::uint32_t>{1});
  CHECK(neighbours[2].empty());
  const auto joint = peers::joint_beliefs({0.6, 0.01, 0.6}, neighbours, 1.0);
  CHECK(joint[0] < 0.6);
  CHECK(joint[2] == Approx(0.6));
  peers::LogOddsCounter counter(0.7, 0.05, 3.5);
  for (int i = 0; i < 50; ++i) counter.update(false);
  CHECK(counter.probability() == Approx(1.0 / (1.0 + std::exp(3.5))));
}

TEST_CASE("Sight is crossed by what stands between", "[existence]") {
  float at = 0.0F;
  const Segment wall{{1.0F, -1.0F}, {1.0F, 1.0F}};
  CHECK(crosses(wall, {0.0F, 0.0F}, {4.0F, 0.0F}, at));
  CHECK(at == Approx(0.25F));
  CHECK_FALSE(crosses(wall, {0.0F, 0.0F}, {0.9F, 0.0F}, at));
  CHECK_FALSE(crosses(wall, {0.0F, 2.0F}, {4.0F, 2.0F}, at));
}

TEST_CASE("Worlds follow from their seed, and the ideal knows them", "[existence]") {
  WorldSetting setting;
  setting.points = 60;
  setting.side_m = 40.0;
  const History history = make_history(setting, 5);
  const History again = make_history(setting, 5);
  REQUIRE(history.drives.size() == 5);
  REQUIRE(history.drives.back().looks.size() == again.drives.back().looks.size());
  for (const MethodKind& kind : method_kinds({history})) {
    const TunedMethod method{kind.name, kind.make,
                             kind.grid.empty() ? std::vector<double>{} : kind.grid.front()};
    const auto results = run_method(method, history);
    REQUIRE(results.size() == 3);
    for (const ScoredPoint& point : results.back().scored) {
      REQUIRE(std::isfinite(point.probability));
      REQUIRE((point.probability >= 0.0 && point.probability <= 1.0));
    }
    const double area = roc_area(results.back().scored);
    if (kind.name == "ideal") CHECK(area == 1.0);
    if (kind.name == "icosahedral") CHECK(area > 0.95);
  }
}

TEST_CASE("The lorry beside a clear-cut hides all that it should", "[existence]") {
  const History history = make_clear_cut({}, 3);
  const std::vector<PointTruth>& truth = history.drives.back().truth;
  const auto hidden = [&](const PointTruth& point) { return point.is_hidden; };
  CHECK(std::count_if(truth.begin() + 50, truth.begin() + 70, hidden) == 20);
  CHECK(std::none_of(truth.begin(), truth.begin() + 50,
                     [](const PointTruth& point) { return point.exists; }));
}

TEST_CASE("Censuses and mortality are read", "[existence]") {
  const auto stems = read_census(
      "tree_id,x_m,y_m,dbh_2008_cm,dbh_2014_cm\n1,1.5,2,20,21\n2,3,4,12,\n3,5,6,9,10\n4,7,8,,15\n");
  REQUIRE(stems.size() == 2);
  CHECK_FALSE(stems[0].is_gone);
  CHECK(stems[1].is_gone);
  CHECK_THROWS_AS(read_census("a,b\n1,2\n"), std::runtime_error);

  std::string header("treeID");
  for (int c = 1; c <= 7; ++c) {
    const std::string n = std::to_string(c);
    header.append(",c").append(n).append("_date,c").append(n).append("_status");
  }
  const Mortality mortality =
      read_mortality(header +
                     "\n1,2000-01-01,alive,2005-01-01,alive,2010-01-01,dead,,,,,,,,\n2,2000-01-01,"
                     "prior,2005-01-01,alive,2010-01-01,alive,,,,,,,,\n");
  CHECK(mortality.trees == 2);
  CHECK(mortality.died == 1);
  CHECK(mortality.tree_years == Approx(12.5).margin(0.01));
}

TEST_CASE("Big Woods has the change that its README states", "[existence][recorded]") {
  const auto stems = read_census(read_text(test::recording("stem_censuses/big_woods.csv")));
  std::size_t gone = 0;
  for (const CensusStem& stem : stems) gone += stem.is_gone ? 1 : 0;
  CHECK(stems.size() == 8302);
  CHECK(gone == 408);
}

TEST_CASE("A drive through a census shares its errors from place to place and states all of them",
          "[existence]") {
  std::vector<CensusStem> stems;
  std::mt19937_64 random(17);
  std::uniform_real_distribution<float> place(0.0F, 120.0F);
  for (int i = 0; i < 400; ++i) stems.push_back({{place(random), place(random)}, 0.1F});
  ForestSetting setting;
  setting.scan_every_m = 0.5;
  const StemGrid grid(stems, setting.range_m);

  for (const bool is_shared : {false, true}) {
    const census::CensusErrors errors = census::census_errors(is_shared);
    const std::vector<geometry::SE2> path = census::lanes_there_and_back(stems, setting, 3.0);
    ForestDrive looks(stems, grid, setting, false, random);
    census::CensusDrive drive(looks, path, 1, errors, 5, 6, random);
    std::map<std::uint32_t, Eigen::Vector2d> before;
    double squares = 0.0, products = 0.0;
    int detections = 0, pairs = 0;
    for (std::size_t at = 0; const auto scan = drive.next(setting.range_m); ++at) {
      std::map<std::uint32_t, Eigen::Vector2d> now;
      for (std::size_t i = 0; i < scan->stems.size(); ++i) {
        const model::Detection& detection = scan->landmarks.detections[i];
        const double stated_m2 = detection.covariance_m2(0, 0);
        CHECK(stated_m2 == Approx(errors.stated_sigma_m * errors.stated_sigma_m));
        const Eigen::Vector2d seen_m = path[at] * Eigen::Vector2d(detection.position_m.head<2>());
        const std::uint32_t stem = scan->stems[i];
        now[stem] = seen_m - stems[stem].place_m.cast<double>();
        squares += now[stem].squaredNorm();
        ++detections;
        if (const auto found = before.find(stem); found != before.end()) {
          products += now[stem].dot(found->second);
          ++pairs;
        }
      }
      before = std::move(now);
    }

    REQUIRE(pairs > 1000);
    const double variance = squares / (2.0 * detections);
    CHECK(std::sqrt(variance) == Approx(errors.stated_sigma_m).epsilon(0.1));
    CHECK(products / (2.0 * pairs) / variance == Approx(is_shared ? 0.93 : 0.0).margin(0.05));
  }
}
