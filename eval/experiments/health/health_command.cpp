// `understory eval health`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/health/health.hpp"
#include "eval/experiments/health/health_drive.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::health {
namespace {

struct HealthOptions {
  int drives = 20;
  std::uint64_t seed = 1;
  int jobs = 1;
  std::string only;
  std::filesystem::path json;
};

/// The drives of one kind of fault together.
struct Row {
  std::string fault;
  int drives = 0;
  DriveVerdict sum;
};

void add(const DriveVerdict& one, Row& row) {
  ++row.drives;
  row.sum.scans += one.scans;
  row.sum.scans_not_ok += one.scans_not_ok;
  row.sum.errors += one.errors;
  row.sum.errors_unnoticed += one.errors_unnoticed;
  row.sum.largest_error_m = std::max(row.sum.largest_error_m, one.largest_error_m);
  for (const auto& [name, count] : one.reasons) row.sum.reasons[name] += count;
}

double ok_percent(const Row& row) {
  return 100.0 * (1.0 - static_cast<double>(row.sum.scans_not_ok) / std::max(row.sum.scans, 1));
}

nlohmann::json to_json(const Row& row) {
  return {{"fault", row.fault},
          {"drives", row.drives},
          {"ok_percent", ok_percent(row)},
          {"errors", row.sum.errors},
          {"errors_unnoticed", row.sum.errors_unnoticed},
          {"largest_error_m", row.sum.largest_error_m},
          {"reasons", row.sum.reasons}};
}

/// No fault, and those whose name has `only` in it.
std::vector<Fault> faults_with(const std::string& only) {
  std::vector<Fault> kinds = faults();
  std::erase_if(kinds, [&](const Fault& kind) {
    return kind.name != "none" && kind.name.find(only) == std::string::npos;
  });
  if (kinds.size() < 2) throw std::invalid_argument("--only: no fault has this in its name");
  return kinds;
}

/// As many drives without a fault as with one; the faults take turns.
void run(const HealthOptions& options) {
  const std::vector<Fault> kinds = faults_with(options.only);
  const auto drives = static_cast<std::size_t>(options.drives);
  std::vector<DriveVerdict> verdicts(2 * drives);
  const auto kind_of = [&](std::size_t i) { return i < drives ? 0 : 1 + i % (kinds.size() - 1); };
  tools::run_in_parallel(
      2 * drives, options.jobs, "drives", terminal::catch_interrupts(),
      [&](std::size_t i) { verdicts[i] = drive(kinds[kind_of(i)], {}, options.seed + i); });

  std::vector<Row> rows;
  rows.reserve(kinds.size());
  for (const Fault& kind : kinds) rows.push_back({kind.name, 0, {}});
  for (std::size_t i = 0; i < verdicts.size(); ++i) add(verdicts[i], rows[kind_of(i)]);

  fmt::print("{:<26} {:>7} {:>8} {:>7} {:>10} {:>10}\n", "fault", "drives", "OK %", "errors",
             "unnoticed", "largest m");
  nlohmann::json table = nlohmann::json::array();
  for (const Row& row : rows) {
    if (row.drives == 0) continue;
    fmt::print("{:<26} {:>7} {:>8.2f} {:>7} {:>10} {:>10.2f}\n", row.fault, row.drives,
               ok_percent(row), row.sum.errors, row.sum.errors_unnoticed, row.sum.largest_error_m);
    table.push_back(to_json(row));
  }
  if (options.json.empty()) return;
  nlohmann::json config = {{"drives", options.drives}, {"seed", options.seed}};
  if (!options.only.empty()) config["only"] = options.only;
  harness::write_json(options.json, harness::result_document("health", config, table));
}

}  // namespace

void add_health_experiment(CLI::App& eval) {
  auto* command = eval.add_subcommand(
      "health", "Is HEALTH not OK where the pose is wrong, and OK where it is right?");
  auto options = std::make_shared<HealthOptions>();
  add_number(*command, "--drives", options->drives, 1, 100000,
             "Drives without a fault, and as many with one");
  command->add_option("--seed", options->seed, "Seed of all randomness")->capture_default_str();
  command->add_option("--only", options->only, "Only faults whose name contains this");
  add_number(*command, "--jobs", options->jobs, 1, 1024, "Drives side by side");
  command->add_option("--json", options->json, "Result file");
  command->callback([options] { run_guarded("health", [&] { run(*options); }); });
}

}  // namespace understory::eval::experiments::health
