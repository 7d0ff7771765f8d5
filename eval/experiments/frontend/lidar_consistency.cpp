#include "eval/experiments/frontend/lidar_consistency.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "eval/harness/chain_drive.hpp"
#include "eval/tools/parallel.hpp"
#include "services/associator/adapter.hpp"
#include "services/ekf/adapter.hpp"
#include "services/landmark_extractor/adapter.hpp"
#include "services/lidar_imu_input/adapter.hpp"
#include "sim/scenarios.hpp"

namespace understory::eval::experiments::frontend {
namespace {

constexpr double kTurn_s = 0.1;

sim::SensorDrive lidar_drive(const LidarDriveOptions& options, std::uint64_t seed) {
  sim::ForestScenarioParameters forest;
  forest.length_m = options.length_m;
  sim::SensorSuite suite;
  suite.gnss.reset();
  if (!options.has_wheels) suite.wheels.reset();
  sim::SpeedParameters speed;
  speed.standstill_s = options.stationary_s;
  return {sim::forest_scenario(forest, seed), speed, suite, seed};
}

/// Root of the filter's mean variance of the position [m].
double claimed_rms_m(std::span<const EkfDriveResult> runs, ScanRange scans) {
  double sum = 0.0;
  for (const EkfDriveResult& run : runs) {
    for (std::size_t k = scans.first; k < scans.last; ++k) sum += run.claimed_m2[k];
  }
  return std::sqrt(sum / static_cast<double>(runs.size() * (scans.last - scans.first)));
}

double error_rms_m(std::span<const EkfDriveResult> runs, ScanRange scans) {
  double sum = 0.0;
  for (const EkfDriveResult& run : runs) {
    for (std::size_t k = scans.first; k < scans.last; ++k) sum += run.error_m2[k];
  }
  return std::sqrt(sum / static_cast<double>(runs.size() * (scans.last - scans.first)));
}

void add_range_rows(std::span<const EkfDriveResult> results, ScanRange scans,
                    const std::string& when, FrontendRows& rows) {
  rows.state("mean NEES of the pose, " + when + " (3 is exact)", mean_nees(results, scans), "");
  rows.state("NEES of single drives inside their 95 % band, " + when,
             100.0 * share_in_band(results, scans, 1), "%");
  rows.state("position's error, " + when, 1e3 * error_rms_m(results, scans), "mm");
  rows.state("standard deviation reported for it, " + when, 1e3 * claimed_rms_m(results, scans),
             "mm");
}

}  // namespace

EkfDriveResult run_lidar_drive(const LidarDriveOptions& options, std::uint64_t seed) {
  sim::SensorDrive drive = lidar_drive(options, seed);
  harness::SensorChain chain(
      {lidar_imu_input::lidar_imu_input_service(), landmark_extractor::landmark_extractor_service(),
       associator::associator_service(), ekf::ekf_service()},
      options.config_dir);

  EkfDriveResult result;
  std::optional<geometry::SE2> start;
  model::Utime last_scan = 0;
  chain.watch<model::TrackedScan>("TRACKED_LANDMARKS",
                                  [&](const model::TrackedScan& scan) { last_scan = scan.utime; });
  chain.watch<model::EkfPose>("EKF_POSE", [&](const model::EkfPose& pose) {
    const geometry::SE2 world = drive.state_at(pose.utime).world_T_level();
    if (!start) start = world * pose.ekf_map_T_vehicle.inverse();
    // Some poses come without a scan.
    if (pose.utime == last_scan) add_pose_nees(pose, start->inverse() * world, result);
    result.restarts = pose.reset_counter;
  });

  std::uint64_t parts = 0;
  while (const auto reading = drive.next()) {
    const auto* sweep = std::get_if<sim::SimulatedSweep>(&*reading);
    if (sweep != nullptr) {
      if (1e-6 * static_cast<double>(sweep->raw.utime) + kTurn_s > options.duration_s) break;
      if (options.progress) options.progress();
    }
    for (const harness::RawMessage& message : harness::raw_messages(*reading, parts))
      chain.feed(message);
  }

  chain.finish();
  return result;
}

void add_lidar_filter_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                           FrontendRows& rows) {
  for (const bool has_wheels : {true, false}) {
    LidarDriveOptions drive;
    drive.config_dir = options.config_dir;
    drive.has_wheels = has_wheels;
    drive.progress = [&] {
      if (stop) throw std::runtime_error("interrupted");
    };

    std::vector<EkfDriveResult> results(static_cast<std::size_t>(std::max(6, options.runs / 50)));
    tools::run_in_parallel(
        results.size(), options.jobs, "filter behind the LIDAR", stop,
        [&](std::size_t run) { results[run] = run_lidar_drive(drive, options.seed * 1000 + run); });

    // The shortest drive limits the range of scans.
    std::size_t scans = results.front().nees.size();
    std::uint64_t restarts = 0;
    for (EkfDriveResult& result : results) {
      scans = std::min(scans, result.nees.size());
      restarts += result.restarts;
    }

    const auto moving = static_cast<std::size_t>(std::lround(drive.stationary_s / kTurn_s));
    rows.in(fmt::format("ekf behind the simulated LIDAR, forest, {} ({} drives of {:.0f} s)",
                        has_wheels ? "wheels and IMU" : "IMU alone", results.size(),
                        drive.duration_s));
    add_range_rows(results, {1, std::min(moving, scans)}, "stationary", rows);
    if (moving < scans) add_range_rows(results, {moving, scans}, "moving", rows);
    rows.at_most("restarts", static_cast<double>(restarts), "", 0.0);
  }
}

}  // namespace understory::eval::experiments::frontend
