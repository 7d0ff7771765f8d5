#include <fmt/format.h>

#include <cstdio>
#include <utility>

#include "eval/experiments/existence/forest.hpp"
#include "eval/experiments/existence/own_methods.hpp"
#include "eval/experiments/existence/parts.hpp"
#include "eval/experiments/existence/references.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::existence {
namespace {

constexpr double kYearOfSeconds = 365.25 * 86400.0;
constexpr double kMonthOfSeconds = 30.0 * 86400.0;
/// Runs of the forest: each has 8,302 stems.
constexpr std::size_t kForestRuns = 3;

std::vector<ScoredPoint> all_of(const AfterDrive& after) {
  std::vector<ScoredPoint> all = after.scored;
  all.insert(all.end(), after.rest.begin(), after.rest.end());
  return all;
}

nlohmann::json forest_row(const std::string& method, const std::vector<ScoredPoint>& points,
                          const ForestSetting& setting, std::size_t drives) {
  return {{"part", setting.is_changed ? "forest" : "forest-control"},
          {"method", method},
          {"missed_pct", 100.0 * setting.pass_missed},
          {"drives", drives},
          {"points", points.size()},
          {"auc", roc_area(points)},
          {"average_precision", average_precision(points)},
          {"brier", brier_score(points)},
          {"found_at_1_pct", 100.0 * found_at(points, 0.01)},
          {"wrongly_removed_pct", 100.0 * removed_share(points, true)},
          {"gone_removed_pct", 100.0 * removed_share(points, false)}};
}

/// A method's answers after each drive, all runs together; all mapped stems are scored.
std::vector<std::vector<ScoredPoint>> forest_answers(const TunedMethod& method,
                                                     const std::vector<History>& histories) {
  std::vector<std::vector<ScoredPoint>> answers;
  for (const History& history : histories) {
    const std::vector<AfterDrive> results = run_method(method, history);
    answers.resize(results.size());
    for (std::size_t k = 0; k < results.size(); ++k) {
      const std::vector<ScoredPoint> points = all_of(results[k]);
      answers[k].insert(answers[k].end(), points.begin(), points.end());
    }
  }
  return answers;
}

void run_setting(ExistenceRun& run, const std::vector<CensusStem>& stems,
                 const std::vector<TunedMethod>& methods, const ForestSetting& setting) {
  std::vector<History> histories(kForestRuns);
  tools::run_in_parallel(kForestRuns, run.jobs, "forest", run.stop, [&](std::size_t i) {
    histories[i] = drive_forest(stems, setting, run.seed + i);
  });
  std::vector<std::vector<std::vector<ScoredPoint>>> answers(methods.size());
  tools::run_in_parallel(methods.size(), run.jobs, "methods", run.stop, [&](std::size_t i) {
    answers[i] = forest_answers(methods[i], histories);
  });
  for (std::size_t i = 0; i < methods.size(); ++i) {
    for (const std::size_t drives : {1U, 2U, 3U, 5U}) {
      nlohmann::json row = forest_row(methods[i].name, answers[i][drives - 1], setting, drives);
      fmt::print(
          "{:<15} {:<36} missed {:>2.0f} %, {} drives: AUC {}, found at 1 % {}, wrong {} %, "
          "found {} %, Brier {}\n",
          row["part"].get<std::string>(), methods[i].name, 100.0 * setting.pass_missed, drives,
          shown(row, "auc", 4), shown(row, "found_at_1_pct", 1),
          shown(row, "wrongly_removed_pct", 2), shown(row, "gone_removed_pct", 1),
          shown(row, "brier", 4));
      run.rows.push_back(std::move(row));
    }
  }
  std::fflush(stdout);
}

/// As tuned, but the decay is that of trees, learned elsewhere and worth 20 of them here.
std::vector<TunedMethod> forest_methods(const ExistenceRun& run, double rate_per_s) {
  std::vector<TunedMethod> methods;
  for (const TunedMethod& method : run.methods) {
    const std::string& name = method.name;
    if (name == "ideal" || name == "no removal") continue;
    methods.push_back(method);
    const bool is_own = name.rfind("icosahedral", 0) == 0 || name == "von Mises-Fisher";
    if (is_own) methods.back().tuned = {rate_per_s * kMonthOfSeconds, 20.0, 0.7, 4.0};
  }
  return methods;
}

}  // namespace

void run_forest(ExistenceRun& run) {
  const Mortality mortality =
      read_mortality(read_text(run.data / "tree_existence/bci_1000trees_7censuses.csv"));
  const double rate_per_s = mortality.rate.mean_per_s();
  run.rows.push_back(
      {{"part", "mortality"},
       {"trees", mortality.trees},
       {"died", mortality.died},
       {"rate_pct_per_year", 100.0 * rate_per_s * kYearOfSeconds},
       {"sigma_pct_per_year", 100.0 * mortality.rate.sigma_per_s() * kYearOfSeconds},
       {"plain_pct_per_year", 100.0 * static_cast<double>(mortality.died) / mortality.tree_years}});
  fmt::print("mortality: {} +- {} % a year of {} trees ({} % by deaths over tree years)\n",
             shown(run.rows.back(), "rate_pct_per_year", 2),
             shown(run.rows.back(), "sigma_pct_per_year", 2), mortality.trees,
             shown(run.rows.back(), "plain_pct_per_year", 2));

  const std::vector<CensusStem> stems =
      read_census(read_text(run.data / "stem_censuses/big_woods.csv"));
  const std::vector<TunedMethod> methods = forest_methods(run, rate_per_s);
  for (const bool is_changed : {true, false}) {
    for (const double missed : {0.36, 0.66}) {
      ForestSetting setting;
      setting.pass_missed = missed;
      setting.is_changed = is_changed;
      run_setting(run, stems, methods, setting);
    }
  }
}

}  // namespace understory::eval::experiments::existence
