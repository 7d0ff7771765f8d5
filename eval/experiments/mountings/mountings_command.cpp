// `understory eval mountings`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/mountings/mounting_drive.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::mountings {
namespace {

/// What is promised: named so long after the start of motion [s].
constexpr double kPromised_s = 10.0;

struct MountingsOptions {
  int drives = 10;
  int sound_drives = 40;
  int faults = 20;
  std::uint64_t first_seed = 1;
  double length_m = 100.0;
  std::string only;
  std::filesystem::path config_dir = "deploy/config/lidar";
  int jobs = 1;
  std::string json;
};

/// One fault on one drive.
struct Trial {
  std::uint64_t seed = 0;
  std::string path;
  MountingFault fault;
  MountingVerdict verdict;
};

/// Named in time or harmless, and nobody else was blamed.
struct Judgement {
  bool is_named = false;
  bool is_inside = false;  ///< Both poses, within 3 sigma until it was named.
  bool blames_other = false;
};

Judgement judge(const MountingVerdict& verdict) {
  return {verdict.named_s && *verdict.named_s <= kPromised_s,
          verdict.slam.is_inside() && verdict.filter.is_inside(), !verdict.blamed.empty()};
}

std::vector<std::string> kinds_with(const std::string& only) {
  std::vector<std::string> kinds = mounting_kinds();
  std::erase_if(kinds,
                [&](const std::string& kind) { return kind.find(only) == std::string::npos; });
  if (kinds.empty() && only != "none")
    throw std::invalid_argument("--only: no fault has this in its name");
  return kinds;
}

/// The kinds go round over all drives.
std::vector<MountingFault> faults_of(const MountingsOptions& options, int drive) {
  if (drive >= options.drives) return {MountingFault{}};
  const std::vector<std::string> kinds = kinds_with(options.only);
  std::mt19937_64 random(options.first_seed + static_cast<std::uint64_t>(drive));
  std::vector<MountingFault> faults;
  for (int i = 0; i < options.faults && !kinds.empty(); ++i) {
    const auto which = static_cast<std::size_t>(drive * options.faults + i) % kinds.size();
    faults.push_back(draw_fault(kinds[which], random));
  }
  return faults;
}

nlohmann::json to_json(const PoseScore& score) {
  return {{"poses", score.poses},
          {"outside", score.outside},
          {"largest_m", score.largest_m},
          {"sigmas", score.largest_sigmas}};
}

nlohmann::json to_json(const Trial& trial) {
  const MountingVerdict& verdict = trial.verdict;
  return {{"seed", trial.seed},
          {"path", trial.path},
          {"culprit", to_string(trial.fault.culprit)},
          {"kind", trial.fault.kind},
          {"value", trial.fault.value},
          {"named_s", verdict.named_s ? nlohmann::json(*verdict.named_s) : nlohmann::json()},
          {"named_as", verdict.named_as},
          {"blamed", verdict.blamed},
          {"slam", to_json(verdict.slam)},
          {"ekf", to_json(verdict.filter)},
          {"heard", verdict.heard}};
}

void print(const Trial& trial) {
  const MountingVerdict& verdict = trial.verdict;
  const auto of = [](const PoseScore& score) {
    return fmt::format("{:>3}/{:<3} {:>6.2f} m {:>6.1f}", score.outside, score.poses,
                       score.largest_m, score.largest_sigmas);
  };
  std::string blamed;
  for (const auto& [what, at_s] : verdict.blamed)
    blamed += fmt::format(" {} at {:.1f}", what, at_s);
  fmt::print("{:>5} {:<12} {:<34} {:<22} {:>7} | {} | {} |{}\n", trial.seed, trial.path,
             trial.fault.kind, trial.fault.value,
             verdict.named_s ? fmt::format("{:.1f} s", *verdict.named_s) : "-", of(verdict.slam),
             of(verdict.filter), blamed);
  std::fflush(stdout);
}

/// How a kind's trials went.
void print_sums(const std::vector<Trial>& trials) {
  std::map<std::string, std::array<int, 5>> sums;
  for (const Trial& trial : trials) {
    const Judgement judged = judge(trial.verdict);
    auto& [count, named, inside, neither, blames] = sums[trial.fault.kind];
    ++count;
    if (judged.is_named) ++named;
    if (!judged.is_named && judged.is_inside) ++inside;
    if (!judged.is_named && !judged.is_inside) ++neither;
    if (judged.blames_other) ++blames;
  }
  fmt::print("\n{:<36} {:>6} {:>6} {:>9} {:>8} {:>7}\n", "", "trials", "named", "in sigma",
             "neither", "blamed");
  for (const auto& [kind, sum] : sums)
    fmt::print("{:<36} {:>6} {:>6} {:>9} {:>8} {:>7}\n", kind, sum[0], sum[1], sum[2], sum[3],
               sum[4]);
}

void run(const MountingsOptions& options) {
  std::mutex mutex;
  std::vector<Trial> trials;
  tools::run_in_parallel(
      static_cast<std::size_t>(options.drives + options.sound_drives), options.jobs, "mountings",
      terminal::catch_interrupts(), [&](std::size_t i) {
        const std::uint64_t seed = options.first_seed + i;
        const ReadingTape tape = record_readings(options.length_m, seed);
        for (const MountingFault& fault : faults_of(options, static_cast<int>(i))) {
          const Trial trial{seed, tape.path, fault, drive(tape, fault, options.config_dir)};
          const std::scoped_lock lock(mutex);
          print(trial);
          trials.push_back(trial);
        }
      });
  std::ranges::stable_sort(trials, {}, &Trial::seed);
  print_sums(trials);
  if (options.json.empty()) return;

  nlohmann::json rows = nlohmann::json::array();
  for (const Trial& trial : trials) rows.push_back(to_json(trial));
  const nlohmann::json config = {{"seed", options.first_seed},           {"drives", options.drives},
                                 {"sound_drives", options.sound_drives}, {"faults", options.faults},
                                 {"length_m", options.length_m},         {"only", options.only},
                                 {"config", options.config_dir.string()}};
  harness::write_json(options.json, harness::result_document("mountings", config, rows));
}

}  // namespace

void add_mountings_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "mountings",
      "One wrong mounting, unit or sign of IMU, LIDAR or wheels: is the right sensor named?");
  const auto options = std::make_shared<MountingsOptions>();
  add_number(command, "--drives", options->drives, 0, 100000, "Drives, each with --faults trials");
  add_number(command, "--faults", options->faults, 1, 1000,
             "Trials on each drive, one after another");
  add_number(command, "--sound-drives", options->sound_drives, 0, 100000,
             "Drives without any fault, with other seeds");
  command.add_option("--first-seed", options->first_seed, "First seed; the others follow it")
      ->capture_default_str();

  add_number(command, "--length-m", options->length_m, 40.0, 100000.0, "Length of a drive [m]");
  command.add_option("--only", options->only, "Only faults whose name contains this");
  command.add_option("--config", options->config_dir, "Configuration of the chain's services")
      ->capture_default_str();
  add_number(command, "--jobs", options->jobs, 1, 256, "Drives side by side");
  command.add_option("--json", options->json, "Result document");
  command.callback([options] { run_guarded("mountings", [options] { run(*options); }); });
}

}  // namespace understory::eval::experiments::mountings
