// Processes that hang and sensors that are silent for a while: what the pose does.
#include <Eigen/Cholesky>
#include <optional>

#include "eval/harness/chain_drive.hpp"
#include "sim/scenarios.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval::harness;

namespace {

constexpr double kGapFrom_s = 32.0;

struct GapCase {
  std::string name;
  std::string service;  ///< That hangs, or
  std::string channel;  ///< that is silent.
  double seconds = 1.1;
};

ChainRun drive_with(const GapCase& gap, std::uint64_t seed) {
  sim::ForestScenarioParameters forest;
  forest.length_m = 80.0;
  sim::SensorSuite suite;
  suite.lidar->elevations_rad = sim::beam_elevations_rad(sim::LidarModel::kVlp16);
  suite.lidar->columns = 900;
  sim::SensorDrive drive(sim::forest_scenario(forest, seed), sim::SpeedParameters{}, suite, seed);

  ChainOptions options;
  options.config_dir = UNDERSTORY_SOURCE_CONFIG "/lidar";
  const double to_s = kGapFrom_s + gap.seconds;
  if (gap.channel.empty() && gap.seconds > 0.0)
    options.pauses = {{gap.service == "all" ? "" : gap.service, kGapFrom_s, to_s}};
  options.meddle = [gap, to_s](RawMessage message) -> std::vector<RawMessage> {
    const double at_s = 1e-6 * static_cast<double>(message.utime);
    if (message.channel == gap.channel && at_s >= kGapFrom_s && at_s < to_s) return {};
    return {std::move(message)};
  };
  return drive_chain(drive, options);
}

struct GapFigures {
  double step_m = 0.0;         ///< Of the error over the gap.
  double nees = 0.0;           ///< Of the first pose after it.
  double largest_after_m = 0;  ///< Error after the gap.
  std::uint64_t resets = 0;
};

/// The filter's poses against the truth; its map begins where the vehicle was stationary.
GapFigures figures_of(const ChainRun& run, double to_s) {
  GapFigures figures;
  std::optional<geometry::SE2> map_T_world;
  std::optional<Eigen::Vector2d> before;
  bool is_first = true;
  for (const model::EkfPose& pose : run.ekf) {
    const double at_s = 1e-6 * static_cast<double>(pose.utime);
    const auto truth = std::ranges::find_if(
        run.truth, [&](const auto& one) { return std::abs(one.utime - pose.utime) < 1'000; });
    if (truth == run.truth.end()) continue;
    if (!map_T_world) map_T_world = pose.ekf_map_T_vehicle * truth->pose.inverse();
    const geometry::SE2 should = *map_T_world * truth->pose;
    const Eigen::Vector2d error = pose.ekf_map_T_vehicle.translation() - should.translation();
    if (at_s < kGapFrom_s) before = error;
    if (at_s < to_s || !before) continue;
    if (std::exchange(is_first, false)) {
      const Eigen::Vector3d off = (pose.ekf_map_T_vehicle.inverse() * should).Log();
      figures.step_m = (error - *before).norm();
      figures.nees =
          off.dot((pose.covariance + 1e-8 * Eigen::Matrix3d::Identity()).llt().solve(off));
    }
    figures.largest_after_m = std::max(figures.largest_after_m, error.norm());
    figures.resets = pose.reset_counter;
  }
  return figures;
}

}  // namespace

TEST_CASE("after a gap of a process or a sensor the pose is where it says", "[gap]") {
  const std::vector<GapCase> cases = {
      {"none", "", "", 0.0},
      {"input 1.1 s", "lidar_imu_input", "", 1.1},
      {"input 2.1 s", "lidar_imu_input", "", 2.1},
      {"ekf 1.1 s", "ekf", "", 1.1},
      {"ekf 3 s", "ekf", "", 3.0},
      {"associator 1.1 s", "associator", "", 1.1},
      {"all 1.1 s", "all", "", 1.1},
      {"all 3 s", "all", "", 3.0},
      {"all 6 s", "all", "", 6.0},
      {"IMU 3 s", "", "RAW_IMU", 3.0},
      {"wheels 3 s", "", "RAW_WHEELS", 3.0},
      {"sweeps 1.1 s", "", "RAW_SWEEP", 1.1},
      {"sweeps 3 s", "", "RAW_SWEEP", 3.0},
  };
  for (const GapCase& gap : cases) {
    const ChainRun run = drive_with(gap, 21);
    const GapFigures figures = figures_of(run, kGapFrom_s + gap.seconds);
    WARN(gap.name << ": step " << figures.step_m << " m, NEES " << figures.nees
                  << ", largest error after " << figures.largest_after_m << " m, resets "
                  << figures.resets);
    CAPTURE(gap.name);
    REQUIRE(run.ekf.size() > 200);
    if (gap.seconds <= 1.1) {
      CHECK(figures.step_m < 0.10);
      CHECK(figures.resets == 0);
    } else {
      CHECK(figures.nees < 14.16);
    }
    const bool knows_motion = !gap.channel.empty() || gap.seconds <= 1.5;
    if (!knows_motion && gap.service != "associator") CHECK(figures.resets >= 1);
  }
}
