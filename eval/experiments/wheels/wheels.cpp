// `understory eval wheels`: do wheels help? The same drives with wheels as they are, with exact
// ones, and without any; and how SLAM_POSE stands to the filter and to its own covariance there.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>

#include "common/io/text_file.hpp"
#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/frontend/frontend_rows.hpp"
#include "eval/harness/chain_drive.hpp"
#include "eval/harness/results.hpp"
#include "eval/harness/summary.hpp"
#include "eval/tools/machine.hpp"
#include "eval/tools/parallel.hpp"
#include "sim/scenarios.hpp"

namespace understory::eval::experiments::wheels {
namespace {

using nlohmann::json;

struct Options {
  int seeds = 20;
  std::uint64_t first_seed = 100;
  double length_m = 1000.0;
  std::string lidar = "vlp32";
  std::vector<std::string> worlds = {"forest", "urban-countryside"};
  std::string config_dir = "deploy/config/lidar";
  int jobs = 1;
  std::string json;
};

/// What the vehicle has of wheels.
constexpr const char* kVariants[] = {"wheels", "exact wheels", "no wheels"};

/// Places of a drive at which the NEES of SLAM_POSE is kept.
constexpr std::size_t kTimes = 40;

/// One drive of one world.
struct Drive {
  std::string world;
  std::uint64_t seed = 0;
  std::string variant;

  std::string key() const { return fmt::format("{}/{}/{}", world, seed, variant); }
};

std::vector<Drive> drives_of(const Options& options) {
  std::vector<Drive> drives;
  for (int i = 0; i < options.seeds; ++i) {
    for (const std::string& world : options.worlds) {
      for (const char* variant : kVariants)
        drives.push_back({world, options.first_seed + static_cast<std::uint64_t>(i), variant});
    }
  }
  return drives;
}

sim::Scenario scenario_of(const Drive& drive, const Options& options) {
  if (drive.world == "urban") return sim::urban_scenario(1, drive.seed);
  if (drive.world == "urban-countryside")
    return sim::urban_to_countryside_scenario(options.length_m, drive.seed);
  if (drive.world == "countryside") return sim::countryside_scenario(options.length_m, drive.seed);
  sim::ForestScenarioParameters forest;
  forest.length_m = options.length_m;
  return sim::forest_scenario(forest, drive.seed);
}

sim::SensorSuite suite_of(const Drive& drive, const Options& options) {
  sim::SensorSuite suite;
  suite.gnss.reset();
  if (options.lidar == "vlp16") {
    suite.lidar->elevations_rad = sim::beam_elevations_rad(sim::LidarModel::kVlp16);
    suite.lidar->columns = 900;
  }

  if (drive.variant == "no wheels") suite.wheels.reset();
  if (drive.variant == "exact wheels") {
    suite.wheels->scale_sigma = 0.0;
    suite.wheels->steering_offset_sigma_rad = 0.0;
  }
  return suite;
}

/// kTimes of the values, evenly over them.
std::vector<double> evenly(const std::vector<double>& values) {
  std::vector<double> taken;
  for (std::size_t k = 1; k <= kTimes && !values.empty(); ++k)
    taken.push_back(values[k * (values.size() - 1) / kTimes]);
  return taken;
}

json drive_once(const Drive& drive, const Options& options, const std::atomic<bool>& stop) {
  sim::SensorDrive sensors(scenario_of(drive, options), sim::SpeedParameters{},
                           suite_of(drive, options), drive.seed);
  harness::ChainOptions chain;
  chain.config_dir = options.config_dir;
  chain.progress = [&](double) {
    if (stop) throw terminal::Interrupted();
  };
  const harness::ChainRun run = drive_chain(sensors, chain);

  const auto ate_m = [&](const std::vector<metrics::StampedPose>& poses) {
    return harness::trajectory_error(poses, run.truth).ate_rms_m;
  };
  const harness::PoseConsistency said = harness::pose_consistency(run.slam, run.truth);
  return {{"world", drive.world},
          {"seed", drive.seed},
          {"variant", drive.variant},
          {"slam_ate_m", harness::trajectory_error(run.slam, run.truth).ate_rms_m},
          {"map_ate_m", ate_m(harness::poses_of(run.keyframes))},
          {"ekf_ate_m", ate_m(harness::poses_of(run.ekf))},
          {"slam_nees", said.mean_nees},
          {"slam_nees_along", evenly(said.nees)},
          {"wrong_updates", wrong_updates(run)}};
}

/// What must be the same for a run to go on; seeds and worlds may be more.
std::string run_of(const Options& options) {
  return fmt::format("version {}, {} m, {}, {}", tools::version(), options.length_m, options.lidar,
                     options.config_dir);
}

/// Done drives by key, kept beside the results after each.
class Progress {
 public:
  explicit Progress(const Options& options) : run_(run_of(options)) {
    if (options.json.empty()) return;
    file_ = options.json + ".progress";
    if (!std::filesystem::exists(file_)) return;
    const json stored = json::parse(io::read_whole_file(file_), nullptr, false);
    if (stored.is_discarded() || !stored.contains("run"))
      throw std::runtime_error(file_.string() + ": no progress of eval wheels");
    if (stored.at("run") != run_) {
      throw std::runtime_error(fmt::format("{}: of another run ({}); this one is {}",
                                           file_.string(), stored.at("run").get<std::string>(),
                                           run_));
    }
    done_ = stored.at("done");
  }

  bool has(const Drive& drive) const { return done_.contains(drive.key()); }
  /// Of a drive that is done.
  const json& at(const Drive& drive) const { return done_.at(drive.key()); }
  void add(const Drive& drive, json figures) {
    const std::scoped_lock lock(mutex_);
    done_[drive.key()] = std::move(figures);
    if (!file_.empty()) harness::write_json(file_, {{"run", run_}, {"done", done_}});
  }

 private:
  std::string run_;
  std::filesystem::path file_;
  json done_ = json::object();
  std::mutex mutex_;
};

/// Geometric mean over the seeds of a figure, or of its ratio to that with wheels.
double mean_of(const Progress& progress, const Options& options, const std::string& world,
               const std::string& variant, const char* figure, bool is_ratio) {
  double sum = 0.0;
  for (int i = 0; i < options.seeds; ++i) {
    const std::uint64_t seed = options.first_seed + static_cast<std::uint64_t>(i);
    const double value = progress.at({world, seed, variant}).at(figure);
    const double with = progress.at({world, seed, "wheels"}).at(figure);
    sum += std::log(is_ratio ? value / with : value);
  }
  return std::exp(sum / options.seeds);
}

/// Seeds on which the variant is better than wheels as they are.
int better_seeds(const Progress& progress, const Options& options, const std::string& world,
                 const std::string& variant, const char* figure) {
  int count = 0;
  for (int i = 0; i < options.seeds; ++i) {
    const std::uint64_t seed = options.first_seed + static_cast<std::uint64_t>(i);
    const double value = progress.at({world, seed, variant}).at(figure);
    count += value < progress.at({world, seed, "wheels"}).at(figure).get<double>() ? 1 : 0;
  }
  return count;
}

/// Geometric mean over the seeds of SLAM_POSE's error over EKF_POSE's.
double pose_over_filter(const Progress& progress, const Options& options, const std::string& world,
                        const std::string& variant) {
  return mean_of(progress, options, world, variant, "slam_ate_m", false) /
         mean_of(progress, options, world, variant, "ekf_ate_m", false);
}

/// How the NEES of SLAM_POSE at some places of each drive lies to what three degrees of freedom
/// give.
struct Bands {
  double single_pct = 0.0;   ///< Poses inside their own 95 % band.
  double beyond_pct = 0.0;   ///< Poses beyond its upper end: 2.5 are exact.
  double of_mean_pct = 0.0;  ///< Places at which the mean of all drives is inside its 95 % band.
};

Bands bands_of(const Progress& progress, const Options& options, const std::string& world,
               const std::string& variant) {
  const std::pair<double, double> band = harness::chi2_band_95(3.0);
  const std::pair<double, double> of_sum = harness::chi2_band_95(3.0 * options.seeds);
  double inside = 0.0;
  double beyond = 0.0;
  std::vector<double> sums(kTimes, 0.0);
  for (int i = 0; i < options.seeds; ++i) {
    const std::uint64_t seed = options.first_seed + static_cast<std::uint64_t>(i);
    const auto along =
        progress.at({world, seed, variant}).at("slam_nees_along").get<std::vector<double>>();
    for (std::size_t k = 0; k < along.size() && k < kTimes; ++k) {
      inside += along[k] >= band.first && along[k] <= band.second ? 1.0 : 0.0;
      beyond += along[k] > band.second ? 1.0 : 0.0;
      sums[k] += along[k];
    }
  }
  const auto means_inside = static_cast<double>(std::ranges::count_if(
      sums, [&](double sum) { return sum >= of_sum.first && sum <= of_sum.second; }));
  const double poses = static_cast<double>(kTimes) * options.seeds;
  return {100.0 * inside / poses, 100.0 * beyond / poses,
          100.0 * means_inside / static_cast<double>(kTimes)};
}

void add_band_rows(const Bands& bands, const std::string& variant, frontend::FrontendRows& rows) {
  rows.between(fmt::format("SLAM_POSE inside its 95 % band, {}", variant), bands.single_pct, "%",
               93.0, 97.0);
  rows.state(fmt::format("SLAM_POSE beyond it (2.5 is exact), {}", variant), bands.beyond_pct, "%");
  rows.state(fmt::format("mean of all drives inside its band, {}", variant), bands.of_mean_pct,
             "%");
}

frontend::FrontendRows rows_of(const Progress& progress, const Options& options) {
  constexpr std::pair<const char*, const char*> kFigures[] = {
      {"slam_ate_m", "SLAM_POSE ATE"},
      {"map_ate_m", "map's keyframes at the end, ATE"},
      {"ekf_ate_m", "EKF_POSE ATE"}};
  frontend::FrontendRows rows;
  for (const std::string& world : options.worlds) {
    rows.in(fmt::format("{}, {:.0f} m, {} seeds from {}", world, options.length_m, options.seeds,
                        options.first_seed));
    for (const auto& [figure, name] : kFigures) {
      for (const char* variant : kVariants) {
        rows.state(fmt::format("{}, {} (geometric mean)", name, variant),
                   mean_of(progress, options, world, variant, figure, false), "m");
      }
      for (const char* variant : {"exact wheels", "no wheels"}) {
        rows.state(fmt::format("{}, {} / wheels", name, variant),
                   mean_of(progress, options, world, variant, figure, true), "");
        rows.state(fmt::format("{}, seeds on which {} are better", name, variant),
                   better_seeds(progress, options, world, variant, figure), "");
      }
    }

    for (const char* variant : kVariants) {
      rows.state(fmt::format("SLAM_POSE mean NEES (3), {} (geometric mean)", variant),
                 mean_of(progress, options, world, variant, "slam_nees", false), "");
    }
    for (const char* variant : {"wheels", "no wheels"}) {
      rows.at_most(fmt::format("SLAM_POSE ATE / EKF_POSE ATE, {}", variant),
                   pose_over_filter(progress, options, world, variant), "", 1.0);
      add_band_rows(bands_of(progress, options, world, variant), variant, rows);
    }
  }
  return rows;
}

void run(const Options& options) {
  const auto& stop = terminal::catch_interrupts();
  Progress progress(options);
  std::vector<Drive> left = drives_of(options);
  std::erase_if(left, [&](const Drive& drive) { return progress.has(drive); });
  tools::run_in_parallel(left.size(), options.jobs, "wheels", stop, [&](std::size_t i) {
    progress.add(left[i], drive_once(left[i], options, stop));
  });

  const frontend::FrontendRows rows = rows_of(progress, options);
  std::cout << to_table(rows.rows());
  if (options.json.empty()) return;

  json document = harness::result_document("wheels",
                                           {{"seed", options.first_seed},
                                            {"seeds", options.seeds},
                                            {"length_m", options.length_m},
                                            {"lidar", options.lidar},
                                            {"config", options.config_dir}},
                                           to_json(rows.rows()));
  document["drives"] = json::array();
  for (const Drive& drive : drives_of(options)) document["drives"].push_back(progress.at(drive));
  harness::write_json(options.json, document);
}

}  // namespace

void add_wheels_experiment(CLI::App& eval) {
  auto* command = eval.add_subcommand(
      "wheels", "The chain with wheels, with exact ones and without, on the same drives");
  auto options = std::make_shared<Options>();
  add_number(*command, "--seeds", options->seeds, 1, 1000, "Number of seeds");
  command->add_option("--first-seed", options->first_seed, "First seed; the others follow it");
  add_number(*command, "--length-m", options->length_m, 50.0, 100000.0,
             "Length of all drives but urban [m]");
  command->add_option("--lidar", options->lidar, "vlp32 (default) or vlp16")
      ->check(CLI::IsMember({"vlp32", "vlp16"}));
  command->add_option("--worlds", options->worlds, "forest, urban, urban-countryside, countryside")
      ->delimiter(',')
      ->check(CLI::IsMember({"forest", "urban", "urban-countryside", "countryside"}));
  command->add_option("--config", options->config_dir, "Configuration of the chain's services");
  add_number(*command, "--jobs", options->jobs, 1, 256, "Drives side by side");
  command->add_option("--json", options->json,
                      "Results; FILE.progress keeps finished drives, and a later call continues");
  command->callback([options] { run_guarded("wheels", [options] { run(*options); }); });
}

}  // namespace understory::eval::experiments::wheels
