// What the experiments' command lines share.
#include "eval/experiments.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

namespace understory::eval {

void add_campaign_options(CLI::App& command, CampaignOptions& options) {
  command.add_option("--runs", options.runs, "Runs per cell")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command.add_option("--seed", options.seed, "Seed of all randomness")->capture_default_str();
  command.add_option("--jobs", options.jobs, "Runs side by side")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  command.add_option("--json", options.json, "Result file; traces and plots go beside it");
  command.add_option("--method", options.methods, "Methods to compare: source, ours, oracle")
      ->delimiter(',')
      ->check(CLI::IsMember({"source", "ours", "oracle"}))
      ->capture_default_str();
  command.add_flag("!--no-plots", options.plots, "Write JSON only");
}

void run_guarded(const std::string& experiment, const std::function<void()>& work) {
  try {
    work();
  } catch (const Interrupted&) {
    fmt::print(stderr, "eval {}: interrupted, nothing written\n", experiment);
    throw CLI::RuntimeError(1);
  } catch (const std::exception& error) {
    fmt::print(stderr, "eval {}: {}\n", experiment, error.what());
    throw CLI::RuntimeError(1);
  }
}

}  // namespace understory::eval
