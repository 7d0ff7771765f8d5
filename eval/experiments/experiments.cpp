// What the experiments' command lines share.
#include "eval/experiments/experiments.hpp"
#include "common/terminal/interrupt.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cstdio>

namespace understory::eval::experiments {
namespace {

void add_options(CLI::App& command, harness::CampaignOptions& options,
                 const std::vector<std::string>& methods) {
  add_number(command, "--runs", options.runs, 1, 100000, "Runs per cell");
  command.add_option("--seed", options.seed, "Seed of all randomness")->capture_default_str();
  add_number(command, "--jobs", options.jobs, 1, 1024, "Runs side by side");
  command.add_option("--json", options.json, "Result file; traces and plots go beside it");
  command
      .add_option("--method", options.methods,
                  fmt::format("Methods to compare: {}", fmt::join(methods, ", ")))
      ->delimiter(',')
      ->check(CLI::IsMember(methods))
      ->capture_default_str();
  command.add_flag("!--no-plots", options.plots, "Write JSON only");
}

}  // namespace

void add_campaign_options(CLI::App& command, harness::CampaignOptions& options) {
  add_options(command, options, {"baseline", "smoothing", "oracle"});
}

void add_campaign_options_with_lidar(CLI::App& command, harness::CampaignOptions& options) {
  add_options(command, options, {"baseline", "smoothing", "oracle", harness::kLidarMethod});
  command
      .add_option("--config", options.chain_config,
                  "Configuration of the services, for the method lidar")
      ->capture_default_str();
}

void run_guarded(const std::string& experiment, const std::function<void()>& work) {
  try {
    work();
  } catch (const terminal::Interrupted&) {
    fmt::print(stderr, "eval {}: interrupted, nothing written\n", experiment);
    throw CLI::RuntimeError(1);
  } catch (const std::exception& error) {
    fmt::print(stderr, "eval {}: {}\n", experiment, error.what());
    throw CLI::RuntimeError(1);
  }
}

}  // namespace understory::eval::experiments
