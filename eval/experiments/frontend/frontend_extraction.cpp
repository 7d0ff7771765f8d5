// Landmark extraction on simulated sweeps with real occlusion.
#include <fmt/format.h>

#include <numbers>

#include "eval/experiments/frontend/frontend.hpp"
#include "eval/experiments/frontend/landmark_extraction.hpp"
#include "eval/tools/parallel.hpp"
#include "sim/scenarios.hpp"

namespace understory::eval::experiments::frontend {
namespace {

struct SimulatedLidar {
  const char* name;
  sim::LidarModel model;
  int columns;
};
const SimulatedLidar kSimulatedLidars[] = {{"16 beams", sim::LidarModel::kVlp16, 1800},
                                           {"32 beams", sim::LidarModel::kVlp32, 1800},
                                           {"64 beams x 2048", sim::LidarModel::kHdl64, 2048}};

sim::SensorDrive extraction_drive(bool is_urban, const SimulatedLidar& lidar, std::uint64_t seed) {
  sim::SensorSuite suite;
  suite.lidar->elevations_rad = sim::beam_elevations_rad(lidar.model);
  suite.lidar->columns = lidar.columns;
  sim::SpeedParameters speed;
  speed.standstill_s = 1.0;
  if (is_urban) return {sim::urban_scenario(1, seed), speed, suite, seed};
  sim::ForestScenarioParameters forest;
  forest.length_m = 400.0;
  return {sim::forest_scenario(forest, seed), speed, suite, seed};
}

}  // namespace

void add_extraction_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                         FrontendRows& rows) {
  const std::size_t count = 2 * std::size(kSimulatedLidars);
  std::vector<ExtractionScore> scores(count);
  tools::run_in_parallel(count, options.jobs, "extraction", stop, [&](std::size_t i) {
    sim::SensorDrive drive = extraction_drive(i % 2 == 1, kSimulatedLidars[i / 2], options.seed);
    ExtractionOptions extraction;
    extraction.sweeps = std::max(20, 6 * options.runs);
    extraction.first_revolution = 30;
    extraction.stride = 10;
    extraction.seed = options.seed;
    scores[i] = score_extraction(drive, {}, extraction);
  });

  for (std::size_t i = 0; i < count; ++i) {
    const ExtractionScore& score = scores[i];
    const bool is_urban = i % 2 == 1;
    const KindScore& kind = is_urban ? score.corners : score.trunks;
    rows.in(fmt::format("landmark_extractor, simulated {}: {} ({} sweeps of {:.0f} points)",
                        is_urban ? "town" : "forest", kSimulatedLidars[i / 2].name, score.sweeps,
                        score.points));

    const char* what = is_urban ? "corners" : "trunks";
    rows.at_least(fmt::format("{}: precision", what), kind.precision(), "", is_urban ? 0.95 : 0.97);
    rows.at_least(fmt::format("{}: recall", what), kind.recall(), "", is_urban ? 0.85 : 0.9);
    rows.at_most(fmt::format("{}: error in the plan, RMS to 20 m", what), 100.0 * kind.rms_m, "cm",
                 is_urban ? 5.0 : 3.0);
    rows.state(fmt::format("{}: mean error along the ray", what), 1e3 * kind.bias_along_m, "mm");
    rows.state(fmt::format("{}: mean error across it", what), 1e3 * kind.bias_across_m, "mm");

    if (is_urban) {
      rows.at_most("corners: bisector, RMS", 180.0 / std::numbers::pi * kind.bearing_rms_rad, "deg",
                   2.0);
      rows.state("corners: NEES of the bisector (1)", kind.nees_bearing, "");
      rows.at_least("poles and trunks in town: precision", score.trunks.precision(), "", 0.97);
      rows.at_least("poles and trunks in town: recall", score.trunks.recall(), "", 0.9);
    }

    rows.between(fmt::format("{}: NEES in the plan (2)", what), kind.nees_plan, "", 1.5, 2.5);
    rows.at_most("time per sweep p99", score.time_p99_ms, "ms", 10.0);
    rows.state("time per sweep median", score.time_p50_ms, "ms");
  }
}

}  // namespace understory::eval::experiments::frontend
