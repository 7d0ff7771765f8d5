#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <memory>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/existence/existence.hpp"
#include "eval/experiments/existence/parts.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::existence {
namespace {

struct ExistenceOptions {
  int runs = 20;
  std::uint64_t seed = 1;
  int jobs = 1;
  std::vector<std::string> only;
  std::string data;
  std::string json;
  bool no_plots = false;
};

const std::vector<std::string> kParts{"worlds", "traps", "false-sightings", "forest"};

std::filesystem::path data_of(const ExistenceOptions& options) {
  if (!options.data.empty()) return options.data;
  const char* const set = std::getenv("UNDERSTORY_DATA");  // NOLINT(concurrency-mt-unsafe)
  return set != nullptr ? set : "../shared/data";
}

std::vector<TunedMethod> tuned_methods(const ExistenceOptions& options,
                                       const std::atomic<bool>& stop) {
  const std::vector<History> training = training_histories();
  const std::vector<MethodKind> kinds = method_kinds(training);
  std::vector<TunedMethod> methods(kinds.size());
  tools::run_in_parallel(kinds.size(), options.jobs, "tuning", stop,
                         [&](std::size_t i) { methods[i] = tune(kinds[i], training); });
  for (const TunedMethod& method : methods)
    fmt::print("tuned: {:<36} {}\n", method.name,
               fmt::format("{}", nlohmann::json(method.tuned).dump()));
  return methods;
}

void write_existence(const ExistenceOptions& options, const ExistenceRun& run) {
  if (options.json.empty()) return;
  nlohmann::json tuned;
  for (const TunedMethod& method : run.methods) tuned[method.name] = method.tuned;
  const nlohmann::json config{{"seed", options.seed}, {"runs", options.runs}, {"tuned", tuned}};
  harness::write_json(options.json, harness::result_document("existence", config, run.rows));
  const auto traces = harness::traces_file(options.json);
  harness::write_json(traces, run.traces);
  if (!options.no_plots) harness::plot("existence.py", {options.json, traces.string()});
}

void run_existence(const ExistenceOptions& options) {
  ExistenceRun run{.runs = options.runs,
                   .seed = options.seed,
                   .jobs = options.jobs,
                   .data = data_of(options),
                   .stop = terminal::catch_interrupts(),
                   .methods = {}};
  run.methods = tuned_methods(options, run.stop);
  const auto is_asked_for = [&](const char* part) {
    return options.only.empty() ||
           std::find(options.only.begin(), options.only.end(), part) != options.only.end();
  };
  if (is_asked_for("worlds")) run_worlds(run);
  if (is_asked_for("traps")) run_traps(run);
  if (is_asked_for("false-sightings")) run_false_sightings(run);
  if (is_asked_for("forest")) run_forest(run);
  trace_shell(run);
  write_existence(options, run);
}

}  // namespace

void add_existence_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "existence",
      "Which points of an old map still exist: changed worlds, occluders, a real forest");
  const auto options = std::make_shared<ExistenceOptions>();
  add_number(command, "--runs", options->runs, 1, 10000, "Worlds per setting");
  command
      .add_option("--seed", options->seed, "Seed of the first world; tuned on 100001 and 100002")
      ->capture_default_str();
  add_number(command, "--jobs", options->jobs, 1, 256, "Jobs side by side");
  command.add_option("--only", options->only, "Only these parts")->check(CLI::IsMember(kParts));
  command.add_option("--data", options->data,
                     "Folder with stem_censuses and tree_existence; default $UNDERSTORY_DATA");
  command.add_option("--json", options->json, "Result document");
  command.add_flag("--no-plots", options->no_plots, "No pictures");
  command.callback([options] { run_guarded("existence", [&] { run_existence(*options); }); });
}

}  // namespace understory::eval::experiments::existence
