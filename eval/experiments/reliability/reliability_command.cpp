// `understory eval reliability`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <span>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/reliability/live_drive.hpp"
#include "eval/experiments/reliability/memory_drive.hpp"
#include "eval/experiments/reliability/processes.hpp"
#include "eval/experiments/reliability/reliability.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"
#include "eval/tools/quantile.hpp"

namespace understory::eval::experiments::reliability {
namespace {

/// The vehicle stands for 20 s, then has driven for some.
constexpr double kFirstFault_s = 30.0;
constexpr std::size_t kMostFaults = 100'000;

struct ReliabilityOptions {
  int drives = 1;
  std::uint64_t first_seed = 1;
  std::size_t faults = 20;
  double longest_s = 10.0;
  double length_m = 1000.0;
  std::string only;
  int load = 0;
  int jobs = 1;
  bool is_undelayed = false;
  bool is_in_memory = false;
  LiveOptions live;
  std::string json;
};

/// Delays of one drive, as many as it has room for.
std::vector<Fault> faults_of(const ReliabilityOptions& options, double drive_s,
                             std::mt19937_64& random) {
  DelayPlan plan{kFirstFault_s, options.longest_s, options.only,
                 processes_of(options.live.config_dir)};
  std::vector<Fault> faults = draw_delays(plan, std::min(options.faults, kMostFaults), random);
  std::erase_if(faults, [&](const Fault& fault) { return fault.to_s + kApart_s > drive_s; });
  return faults;
}

nlohmann::json to_json(const AfterFault& score) {
  return {{"poses", score.poses},
          {"within_3_sigma", score.within_3_sigma},
          {"step_m", score.largest_step_m},
          {"sigmas", score.largest_sigmas},
          {"unannounced_m", score.largest_unannounced_m},
          {"ok_while_far_s", score.ok_while_far_s},
          {"goes_on", score.goes_on},
          {"announced", score.is_announced}};
}

nlohmann::json to_json(const Broken& broken) {
  return {{"not_finite", broken.not_finite},
          {"not_positive_definite", broken.not_positive_definite},
          {"not_later", broken.not_later}};
}

std::string line_of(const Fault& fault, const AfterFault& slam, const AfterFault& filter,
                    const std::string& not_ok) {
  const auto of = [](const AfterFault& score) {
    return fmt::format("{:>4}/{:<4} {:>6.3f} m {:>5.1f} sigma {}", score.within_3_sigma,
                       score.poses, score.largest_step_m, score.largest_sigmas,
                       !score.goes_on       ? "ends"
                       : score.is_announced ? "told"
                                            : "    ");
  };
  return fmt::format("{:<26} {:>5.2f} s | {} | {} | {}\n", fault.what, fault.to_s - fault.from_s,
                     of(slam), of(filter), not_ok);
}

LiveDrive played(const ReliabilityOptions& options, const SensorTape& tape,
                 std::span<const Fault> faults) {
  if (options.is_in_memory) return play_in_memory(tape, faults, options.live.config_dir);
  if (!options.is_undelayed) return play(tape, faults, options.live);
  LiveDrive drive = play_in_memory(tape, {}, options.live.config_dir);
  drive.not_ok.resize(faults.size());
  return drive;
}

/// One drive: its faults as rows, and what holds for the whole of it.
nlohmann::json drive_once(const ReliabilityOptions& options, std::uint64_t seed) {
  const SensorTape tape = record_tape(options.length_m, seed);
  std::mt19937_64 random(seed);
  const std::vector<Fault> faults = faults_of(options, tape.seconds(), random);
  std::string text =
      fmt::format("drive {}: {:.0f} s, {} delays, load {}\n{:<34} | {:<35} | {:<35} | {}\n", seed,
                  tape.seconds(), faults.size(), options.load, "", "SLAM_POSE: in 3 sigma, step",
                  "EKF_POSE", "HEALTH");

  const LiveDrive drive = played(options, tape, faults);

  const std::vector<AfterFault> slam = judge(drive.slam, tape.truth, faults);
  const std::vector<AfterFault> filter = judge(drive.filter, tape.truth, faults);
  nlohmann::json rows = nlohmann::json::array();
  for (std::size_t i = 0; i < faults.size(); ++i) {
    text += line_of(faults[i], slam[i], filter[i], drive.not_ok[i]);
    rows.push_back({{"what", faults[i].what},
                    {"from_s", faults[i].from_s},
                    {"seconds", faults[i].to_s - faults[i].from_s},
                    {"slam", to_json(slam[i])},
                    {"ekf", to_json(filter[i])},
                    {"not_ok", drive.not_ok[i]}});
  }

  const double p50_ms = tools::quantile(drive.latency_ms, 0.5);
  const double p99_ms = tools::quantile(drive.latency_ms, 0.99);
  fmt::print(
      "{}SLAM_POSE behind the end of its sweep, outside of delays: p50 {:.1f} ms, p99 {:.1f} ms; "
      "{} messages lost\n",
      text, p50_ms, p99_ms, drive.lost);
  std::fflush(stdout);
  return {{"seed", seed},
          {"load", options.load},
          {"supervised", options.live.supervised},
          {"drive_s", tape.seconds()},
          {"faults", rows},
          {"slam_broken", to_json(broken(drive.slam))},
          {"ekf_broken", to_json(broken(drive.filter))},
          {"latency_p50_ms", p50_ms},
          {"latency_p99_ms", p99_ms},
          {"lost", drive.lost}};
}

/// What must hold for every pose; a reason to fail whatever the statistics say.
bool is_sound(const nlohmann::json& drive) {
  for (const char* channel : {"slam_broken", "ekf_broken"}) {
    for (const auto& [name, count] : drive.at(channel).items())
      if (count.get<std::size_t>() > 0) return false;
  }
  for (const auto& fault : drive.at("faults")) {
    if (!fault.at("slam").at("goes_on").get<bool>()) return false;
    if (fault.at("slam").at("ok_while_far_s").get<double>() > 2.0) return false;
  }
  return true;
}

/// The drives of an earlier run of the same command, which go on from there.
nlohmann::json drives_in(const std::string& file, const nlohmann::json& config) {
  if (file.empty() || !std::filesystem::exists(file)) return nlohmann::json::array();
  std::ifstream in(file);
  const nlohmann::json document = nlohmann::json::parse(in);
  if (document.at("config") != config)
    throw std::runtime_error(file + ": is of other options; name another file");
  return document.at("rows");
}

std::uint64_t seed_of(const nlohmann::json& drive) { return drive.at("seed").get<std::uint64_t>(); }

std::vector<std::uint64_t> seeds_left(const ReliabilityOptions& options,
                                      const nlohmann::json& drives) {
  std::set<std::uint64_t> done;
  for (const auto& drive : drives) done.insert(seed_of(drive));
  std::vector<std::uint64_t> left;
  for (int i = 0; i < options.drives; ++i) {
    const std::uint64_t seed = options.first_seed + static_cast<std::uint64_t>(i);
    if (!done.contains(seed)) left.push_back(seed);
  }
  return left;
}

void run(const ReliabilityOptions& options) {
  nlohmann::json config = {{"delays", options.faults},
                           {"longest_s", options.longest_s},
                           {"length_m", options.length_m},
                           {"only", options.only},
                           {"load", options.load},
                           {"jobs", options.jobs},
                           {"supervised", options.live.supervised},
                           {"config", options.live.config_dir.string()}};
  if (options.is_undelayed) config["undelayed"] = true;
  if (options.is_in_memory) config["in_memory"] = true;
  nlohmann::json drives = drives_in(options.json, config);
  const std::vector<std::uint64_t> seeds = seeds_left(options, drives);
  Processes load;
  for (int i = 0; i < options.load; ++i) load.start({"/bin/sh", {"-c", "while :; do :; done"}, {}});

  bool all_sound = true;
  std::mutex mutex;
  const auto drive_and_keep = [&](std::size_t i) {
    const nlohmann::json drive = drive_once(options, seeds[i]);
    const std::lock_guard lock(mutex);
    all_sound = all_sound && is_sound(drive);
    drives.push_back(drive);
    std::sort(drives.begin(), drives.end(),
              [](const auto& a, const auto& b) { return seed_of(a) < seed_of(b); });
    if (!options.json.empty())
      harness::write_json(options.json, harness::result_document("reliability", config, drives));
  };
  tools::run_in_parallel(seeds.size(), options.jobs, "drives", terminal::catch_interrupts(),
                         drive_and_keep);
  if (!all_sound)
    throw std::runtime_error(
        "a pose was broken, did not come back, or was over 1 m off for 2 s with HEALTH OK");
}

}  // namespace

void add_reliability_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "reliability",
      "Real processes at the speed of the drive, with delayed messages and stopped processes");
  const auto options = std::make_shared<ReliabilityOptions>();
  add_number(command, "--drives", options->drives, 1, 100000, "Drives");
  command.add_option("--first-seed", options->first_seed, "First seed; the others follow it")
      ->capture_default_str();
  command.add_option("--delays", options->faults, "Most delays of a drive")->capture_default_str();
  add_number(command, "--longest-s", options->longest_s, 0.0, 60.0, "Longest delay [s]");

  add_number(command, "--length-m", options->length_m, 250.0, 100000.0, "Length of a drive [m]");
  command.add_option("--only", options->only, "Only delays whose name contains this");
  CLI::Option* load = add_number(command, "--load", options->load, 0, 256,
                                 "Further processes that only load the processor");
  add_number(command, "--jobs", options->jobs, 1, 64,
             "Drives in parallel; each has its own bus and is load for the others");

  CLI::Option* undelayed =
      command.add_flag("--undelayed", options->is_undelayed,
                       "No processes and no delays: the same drives through the stages in one "
                       "process, judged at the same times");
  CLI::Option* in_memory =
      command
          .add_flag("--in-memory", options->is_in_memory,
                    "No processes: the stages in one process get held messages late, and nothing "
                    "stops; the same bytes each time")
          ->excludes(undelayed);
  CLI::Option* supervised =
      command.add_flag("--supervised", options->live.supervised,
                       "Under `understory launch`, which restarts stopped processes");
  for (CLI::Option* option : {undelayed, in_memory}) option->excludes(load)->excludes(supervised);
  command.add_option("--config", options->live.config_dir, "Configuration of the processes")
      ->capture_default_str();
  command.add_option(
      "--json", options->json,
      "Result document, written after each drive; an interrupted call can be continued");
  command.callback([options] { run_guarded("reliability", [options] { run(*options); }); });
}

}  // namespace understory::eval::experiments::reliability
