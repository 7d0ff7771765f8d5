// `understory eval closures`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/closures/closure_ways.hpp"
#include "eval/experiments/closures/plantation_drive.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/harness/campaign.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::closures {
namespace {

struct ClosuresOptions {
  int runs = 100;
  int plantations = 4;
  std::uint64_t seed = 1;
  int jobs = 1;
  std::string json;
};

const std::vector<Way>& all_ways() {
  static const std::vector<Way> ways{{"shipped", shipped},
                                     {"PCM", pairwise_consistency},
                                     {"PCM, odometry x 100", pairwise_consistency_wide},
                                     {"GNC", graduated_non_convexity},
                                     {"DCS", dynamic_covariance_scaling},
                                     {"DCS, Phi = 3000", dynamic_covariance_scaling_wide},
                                     {"max-mixture", max_mixture},
                                     {"odometry alone", odometry_alone},
                                     {"right ones alone", right_alone}};
  return ways;
}

/// Drives of one sort.
struct Sort {
  std::string odometry;
  std::string sent;
  ClosurePlan plan;
};
std::vector<Sort> all_sorts() {
  std::vector<Sort> sorts;
  for (const bool is_honest : {true, false}) {
    ClosurePlan plan;
    if (!is_honest) {
      plan.stated = 0.1;
      plan.yaw_bias_rad = 1.5e-3;
    }
    const std::string odometry = is_honest ? "honest" : "a tenth";
    sorts.push_back({odometry, "windows", plan});
    plan.rows = 3;
    sorts.push_back({odometry, "windows and rows", plan});
  }
  return sorts;
}

/// Closures by what became of them, and groups that are wrong alike.
struct Count {
  int sent = 0;
  std::array<int, 3> fates{};
  int groups = 0;
  int groups_accepted = 0;
};
struct DriveScore {
  std::array<Count, kKinds> kinds{};
  double ate_m = 0.0;
};

DriveScore score_of(const ClosureDrive& drive, const WayResult& result) {
  DriveScore score;
  std::map<int, bool> accepted;
  std::map<int, Kind> kind_of;
  for (std::size_t i = 0; i < drive.sent.size(); ++i) {
    const SentClosure& one = drive.sent[i];
    Count& count = score.kinds[static_cast<std::size_t>(one.kind)];
    ++count.sent;
    ++count.fates[static_cast<std::size_t>(result.fates[i])];
    if (one.group < 0) continue;
    kind_of.emplace(one.group, one.kind);
    accepted[one.group] = accepted[one.group] || result.fates[i] == Fate::kAccepted;
  }
  for (const auto& [group, kind] : kind_of) {
    ++score.kinds[static_cast<std::size_t>(kind)].groups;
    score.kinds[static_cast<std::size_t>(kind)].groups_accepted += accepted[group] ? 1 : 0;
  }
  score.ate_m = ate_m(result.poses, drive.truth);
  return score;
}

Count sum_of(const std::vector<DriveScore>& scores, Kind kind) {
  Count sum;
  for (const DriveScore& score : scores) {
    const Count& one = score.kinds[static_cast<std::size_t>(kind)];
    sum.sent += one.sent;
    sum.groups += one.groups;
    sum.groups_accepted += one.groups_accepted;
    for (std::size_t i = 0; i < 3; ++i) sum.fates[i] += one.fates[i];
  }
  return sum;
}

/// Upper bound of a share, 95 % one-sided, of which `hits` of `count` were seen (Clopper and
/// Pearson 1934): 3 / count where there was none.
double upper_bound(int hits, int count) {
  if (count == 0 || hits >= count) return 1.0;
  const auto chance_of_so_few = [&](double share) {
    double sum = 0.0;
    for (int i = 0; i <= hits; ++i)
      sum +=
          std::exp(std::lgamma(count + 1.0) - std::lgamma(i + 1.0) - std::lgamma(count - i + 1.0) +
                   i * std::log(share) + (count - i) * std::log1p(-share));
    return sum;
  };
  double low = 1e-12, high = 1.0 - 1e-12;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (chance_of_so_few(middle) > 0.05 ? low : high) = middle;
  }
  return high;
}

nlohmann::json to_json(const Count& count) {
  return {{"sent", count.sent},
          {"accepted", count.fates[0]},
          {"waiting", count.fates[1]},
          {"refused", count.fates[2]},
          {"groups", count.groups},
          {"groups_accepted", count.groups_accepted},
          {"accepted_bound_pct", 100.0 * upper_bound(count.fates[0], count.sent)},
          {"groups_bound_pct", 100.0 * upper_bound(count.groups_accepted, count.groups)}};
}

nlohmann::json row_of(const Sort& sort, const Way& way, const std::vector<DriveScore>& scores) {
  nlohmann::json row = {{"part", "drives"},
                        {"odometry", sort.odometry},
                        {"sent", sort.sent},
                        {"way", way.name},
                        {"drives", scores.size()}};
  for (std::size_t i = 0; i < kKinds; ++i)
    row[name_of(static_cast<Kind>(i))] = to_json(sum_of(scores, static_cast<Kind>(i)));

  double mean_m = 0.0, largest_m = 0.0;
  for (const DriveScore& score : scores) {
    mean_m += score.ate_m / static_cast<double>(scores.size());
    largest_m = std::max(largest_m, score.ate_m);
  }
  row["ate_m"] = mean_m;
  row["largest_ate_m"] = largest_m;
  return row;
}

void print_row(const nlohmann::json& row) {
  const auto cell = [&](Kind kind) {
    const nlohmann::json& count = row[name_of(kind)];
    return fmt::format("{}/{}", count["accepted"].get<int>(), count["sent"].get<int>());
  };
  fmt::print("{:<8} {:<17} {:<20} {:>12} {:>10} {:>10} {:>10} {:>10} {:>8.2f} {:>8.2f}\n",
             row["odometry"].get<std::string>(), row["sent"].get<std::string>(),
             row["way"].get<std::string>(), cell(Kind::kRight), cell(Kind::kAlone),
             cell(Kind::kOneWindow), cell(Kind::kSuccessive), cell(Kind::kRows),
             row["ate_m"].get<double>(), row["largest_ate_m"].get<double>());
  std::fflush(stdout);
}

/// All ways on the same drives.
void add_drives(const ClosuresOptions& options, const std::atomic<bool>& stop,
                nlohmann::json& rows) {
  fmt::print("{:<8} {:<17} {:<20} {:>12} {:>10} {:>10} {:>10} {:>10} {:>8} {:>8}\n", "odometry",
             "sent", "way", "right", "alone", "one-window", "successive", "rows", "ATE m",
             "largest");
  const std::vector<Way>& ways = all_ways();
  for (const Sort& sort : all_sorts()) {
    const auto runs = static_cast<std::size_t>(options.runs);
    std::vector<std::vector<DriveScore>> scores(ways.size(), std::vector<DriveScore>(runs));
    tools::run_in_parallel(
        runs, options.jobs, sort.odometry + ", " + sort.sent, stop, [&](std::size_t i) {
          const ClosureDrive drive =
              make_closure_drive(sort.plan, harness::run_seed(options.seed, static_cast<int>(i)));
          for (std::size_t way = 0; way < ways.size(); ++way)
            scores[way][i] = score_of(drive, ways[way].decide(drive));
        });
    for (std::size_t way = 0; way < ways.size(); ++way) {
      rows.push_back(row_of(sort, ways[way], scores[way]));
      print_row(rows.back());
    }
  }
}

/// What the loop closer itself sends between rows, and what the mapper makes of it.
void add_plantations(const ClosuresOptions& options, const std::atomic<bool>& stop,
                     nlohmann::json& rows) {
  fmt::print("{:<8} {:>8} {:>8} {:>8} {:>8}\n", "sigma m", "right", "accepted", "wrong",
             "accepted");
  for (const double sigma_m : {0.02, 0.1, 0.2, 0.3, 0.4, 0.6, 1.0}) {
    const auto runs = static_cast<std::size_t>(options.plantations);
    std::vector<DriveScore> scores(runs);
    tools::run_in_parallel(runs, options.jobs, "plantations", stop, [&](std::size_t i) {
      PlantationPlan plan;
      plan.sigma_m = sigma_m;
      plan.skip = 2 + static_cast<int>(i) % 3;
      const ClosureDrive drive =
          make_plantation_drive(plan, {}, harness::run_seed(options.seed, static_cast<int>(i)));
      scores[i] = score_of(drive, shipped(drive));
    });
    const Count right = sum_of(scores, Kind::kRight), wrong = sum_of(scores, Kind::kRows);
    rows.push_back({{"part", "plantation"},
                    {"sigma_m", sigma_m},
                    {"drives", runs},
                    {"right", to_json(right)},
                    {"rows", to_json(wrong)}});
    fmt::print("{:<8.2f} {:>8} {:>8} {:>8} {:>8}\n", sigma_m, right.sent, right.fates[0],
               wrong.sent, wrong.fates[0]);
  }
}

void run(const ClosuresOptions& options) {
  const auto& stop = terminal::catch_interrupts();
  nlohmann::json rows = nlohmann::json::array();
  add_drives(options, stop, rows);
  add_plantations(options, stop, rows);
  if (options.json.empty()) return;
  const nlohmann::json config = {
      {"runs", options.runs}, {"plantations", options.plantations}, {"seed", options.seed}};
  harness::write_json(options.json, harness::result_document("closures", config, rows));
}

}  // namespace

void add_closures_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "closures", "True and false loop closures, and which of them known methods accept");
  const auto options = std::make_shared<ClosuresOptions>();
  add_number(command, "--runs", options->runs, 1, 100000, "Drives of each kind");
  add_number(command, "--plantations", options->plantations, 0, 1000,
             "Drives in plantations, for each regularity of the rows");
  command.add_option("--seed", options->seed, "First seed; the others follow it")
      ->capture_default_str();
  add_number(command, "--jobs", options->jobs, 1, 256, "Drives side by side");
  command.add_option("--json", options->json, "Result document");
  command.callback([options] { run_guarded("closures", [options] { run(*options); }); });
}

}  // namespace understory::eval::experiments::closures
