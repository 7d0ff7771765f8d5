// The chain beside its limit, on the forest and the town of the chain's drives.
#include <fmt/format.h>

#include <cmath>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "eval/experiments/frontend/chain_limit.hpp"
#include "eval/experiments/frontend/frontend.hpp"
#include "eval/tools/parallel.hpp"
#include "sim/scenarios.hpp"

namespace understory::eval::experiments::frontend {
namespace {

/// Drives of each kind. In town SLAM_POSE of one drive is at 0.4 to 1.5 times its limit: three
/// would tell little.
constexpr std::size_t kForests = 3;
constexpr std::size_t kTowns = 10;
constexpr std::size_t kTimes = 40;

struct LimitDrive {
  bool is_urban = false;
  std::uint64_t seed = 1;
};

LimitScore score_of(const LimitDrive& which, const FrontendOptions& options,
                    const std::atomic<bool>& stop) {
  sim::ForestScenarioParameters forest;
  forest.length_m = options.drive_m;
  sim::SensorSuite suite;
  if (which.is_urban) suite.gnss.reset();
  sim::SensorDrive drive(which.is_urban ? sim::urban_scenario(1, which.seed)
                                        : sim::forest_scenario(forest, which.seed),
                         sim::SpeedParameters{}, suite, which.seed);
  harness::ChainOptions chain;
  chain.config_dir = options.config_dir;
  chain.keep_measurements = true;
  chain.progress = [&](double) {
    if (stop) throw std::runtime_error("interrupted");
  };
  const harness::ChainRun run = drive_chain(drive, chain);
  return score_against_limit(run, drive.world(), kTimes);
}

void add_score_rows(const LimitScore& score, FrontendRows& rows) {
  rows.state("map at the end: its keyframes, RMS", 1e3 * score.map_rms_m, "mm");
  rows.state("limit of it: batch with true association", 1e3 * score.batch_rms_m, "mm");
  rows.state(fmt::format("SLAM_POSE at {} times, RMS", score.times), 1e3 * score.pose_rms_m, "mm");
  rows.state("limit of it: batch over all data so far", 1e3 * score.causal_rms_m, "mm");
  rows.state("noise of trunks, shown over stated", score.trunk_noise, "");
  rows.state("noise of corners, shown over stated", score.corner_noise, "");
}

/// Geometric means of the ratios.
void add_ratio_rows(std::span<const LimitScore> scores, FrontendRows& rows) {
  double map = 0.0;
  double pose = 0.0;
  for (const LimitScore& score : scores) {
    map += std::log(score.map_rms_m / score.batch_rms_m);
    pose += std::log(score.pose_rms_m / score.causal_rms_m);
  }
  const auto count = static_cast<double>(scores.size());
  rows.at_most("map at the end, over its limit", std::exp(map / count), "x", 1.1);
  rows.at_most("SLAM_POSE, over its limit", std::exp(pose / count), "x", 1.2);
}

}  // namespace

void add_limit_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                    FrontendRows& rows) {
  std::vector<LimitDrive> drives;
  for (const bool is_urban : {false, true})
    for (std::size_t k = 0; k < (is_urban ? kTowns : kForests); ++k)
      drives.push_back({is_urban, options.seed + k});
  std::vector<LimitScore> scores(drives.size());
  tools::run_in_parallel(drives.size(), options.jobs, "limit", stop,
                         [&](std::size_t i) { scores[i] = score_of(drives[i], options, stop); });

  for (std::size_t first = 0; first < drives.size();) {
    const std::size_t count = drives[first].is_urban ? kTowns : kForests;
    const std::string name = drives[first].is_urban
                                 ? "urban block, closed, no GNSS"
                                 : fmt::format("forest, {:.0f} m circle", options.drive_m);
    rows.in(fmt::format("limit of the whole chain, {}, 32 beams, seeds {} to {}", name,
                        options.seed, options.seed + count - 1));
    add_ratio_rows({scores.data() + first, count}, rows);
    for (std::size_t i = first; i < first + count; ++i) {
      rows.in(fmt::format("limit of the whole chain, {}, seed {}", name, drives[i].seed));
      add_score_rows(scores[i], rows);
    }
    first += count;
  }
}

}  // namespace understory::eval::experiments::frontend
