// Associator and filter by themselves, on simulated detections.
#include <fmt/format.h>

#include <cmath>

#include "eval/experiments/frontend/ekf_consistency.hpp"
#include "eval/experiments/frontend/frontend.hpp"
#include "eval/experiments/frontend/lidar_consistency.hpp"
#include "eval/experiments/frontend/tracking.hpp"
#include "eval/harness/run.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::frontend {
namespace {

struct TrackingCell {
  std::string name;
  double position_sigma_m;
  double detection;
  double clutter;
  double speed_mps;
  sim::OdometryKind odometry;
};

const TrackingCell kTrackingCells[] = {
    {"5 cm, 90 %, wheels and IMU", 0.05, 0.9, 0.05, 5.0, sim::OdometryKind::kInertialAndWheels},
    {"20 cm, 90 %, 10 % false, wheels and IMU", 0.2, 0.9, 0.1, 10.0,
     sim::OdometryKind::kInertialAndWheels},
    {"20 cm, 90 %, 10 % false, no odometry", 0.2, 0.9, 0.1, 10.0, sim::OdometryKind::kNone},
};

sim::TrunkField field(std::uint64_t seed) {
  sim::ForestParameters forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  forest.side_m = 600.0;
  return sim::make_trunk_field(forest, seed);
}

/// Sway of a parked vehicle with its engine on, as the filter's own default takes it: error and
/// covariance of a perfectly stationary vehicle would both be zero.
void let_sway(sim::InertialDriveParameters& drive) {
  drive.sway_sigma_m = 2e-4;
  drive.sway_sigma_rad = 3e-5;
  drive.sway_sigma_mps = 0.01;
}

std::vector<EkfDriveResult> drive_filter(const EkfDriveOptions& drive,
                                         const FrontendOptions& options,
                                         const std::atomic<bool>& stop,
                                         const sim::TrunkField& world) {
  std::vector<EkfDriveResult> results(static_cast<std::size_t>(options.runs));
  tools::run_in_parallel(results.size(), options.jobs, "filter", stop, [&](std::size_t run) {
    results[run] = run_ekf_drive(drive, world, options.seed * 1000 + run);
  });
  return results;
}

/// Runs in one group of share_in_band().
constexpr std::size_t kGroup = 50;

void add_consistency_rows(const EkfDriveOptions& options, std::span<const EkfDriveResult> results,
                          const EkfConsistency& summary, FrontendRows& rows) {
  const auto moving = static_cast<std::size_t>(
      std::lround(options.drive.stationary_s / options.drive.scan_interval_s));
  const std::size_t scans = summary.mean_nees.size();
  const ScanRange whole{1, scans};  // The first pose is exact.
  const ScanRange stationary{1, moving};
  const ScanRange driving{moving, scans};
  const auto share = [&](ScanRange range, std::size_t group) {
    return 100.0 * share_in_band(results, range, group);
  };
  rows.between("NEES of the pose inside its 95 % band", share(whole, results.size()), "%", 90.0,
               99.0);
  rows.between("the same, in groups of 50 runs", share(whole, kGroup), "%", 93.0, 97.0);
  rows.state("in groups of 50, stationary", share(stationary, kGroup), "%");
  rows.state("in groups of 50, moving", share(driving, kGroup), "%");
  rows.state("mean NEES of the pose, stationary (3 is exact)", mean_nees(results, stationary), "");
  rows.state("mean NEES of the pose, moving (3)", mean_nees(results, driving), "");
  rows.state("mean NEES of the heading (1)", summary.heading_nees, "");
  rows.state("mean NEES of the position (2)", summary.position_nees, "");
  rows.state("mean NEES of velocity and biases (5)", summary.overall_velocity_nees, "");
}

/// A vehicle that sways, biases that walk and sensors that err by `factor` times what the filter
/// and the messages take them for.
void mismatch(sim::InertialDriveParameters& drive, double factor) {
  drive.sway_sigma_m *= factor;
  drive.sway_sigma_rad *= factor;
  drive.sway_sigma_mps *= factor;
  drive.gyro_walk *= factor;
  drive.accelerometer_walk *= factor;
  drive.true_noise_factor = factor;
}

/// The three ways to measure errors where they differ: long without odometry, few landmarks.
void add_form_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                   const sim::TrunkField& world, FrontendRows& rows) {
  for (const char* form : {"right_invariant", "first_estimate", "plain"}) {
    EkfDriveOptions drive;
    drive.filter.error_form = form;
    drive.drive.odometry = sim::OdometryKind::kNone;
    drive.drive.stationary_s = 0.0;
    drive.drive.position_sigma_m = 0.5;
    drive.drive.range_m = 15.0;
    drive.duration_s = 120.0;
    drive.use_associator = false;
    const std::vector<EkfDriveResult> results = drive_filter(drive, options, stop, world);
    const EkfConsistency summary = summarise(results);
    rows.in(fmt::format("ekf, errors {}: no odometry, 0.5 m, range 15 m ({} runs of {:.0f} m)",
                        form, summary.runs, summary.driven_m));
    const ScanRange whole{1, summary.mean_nees.size()};
    rows.state("NEES of the pose inside its 95 % band, in groups of 50 runs",
               100.0 * share_in_band(results, whole, kGroup), "%");
    rows.state("mean NEES of the pose at the end (3 is exact)", summary.final_nees, "");
    rows.state("drift", summary.drift_percent, "%");
  }
}

}  // namespace

void add_tracking_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                       FrontendRows& rows) {
  const sim::TrunkField world = field(options.seed);
  const auto runs = static_cast<std::size_t>(std::max(1, options.runs / 10));

  for (const TrackingCell& cell : kTrackingCells) {
    TrackingOptions tracking;
    tracking.drive.position_sigma_m = cell.position_sigma_m;
    tracking.drive.detection_probability = cell.detection;
    tracking.drive.clutter_share = cell.clutter;
    tracking.drive.speed_mps = cell.speed_mps;
    tracking.drive.odometry = cell.odometry;

    std::vector<TrackingResult> results(runs);
    tools::run_in_parallel(runs, options.jobs, "tracking", stop, [&](std::size_t run) {
      results[run] = run_tracking(tracking, world, options.seed * 1000 + run);
    });

    double published = 0.0;
    double pure = 0.0;
    double km = 0.0;
    double switches = 0.0;
    double p99_s = 0.0;
    for (const TrackingResult& result : results) {
      published += static_cast<double>(result.published);
      pure += result.purity * static_cast<double>(result.published);
      km += result.driven_km;
      switches += static_cast<double>(result.switches);
      p99_s = std::max(p99_s, result.scan_p99_s);
    }

    rows.in(fmt::format("associator, simulated detections: {} ({:.1f} km)", cell.name, km));
    rows.at_least("purity of tracks", pure / published, "", 0.999);
    rows.at_most("id switches per km", switches / km, "1/km", 1.0);
    rows.state("scan p99", 1e3 * p99_s, "ms");
  }
}

void add_mismatch_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                       FrontendRows& rows) {
  const sim::TrunkField world = field(options.seed);
  for (const double factor : {0.5, 1.0, 2.0}) {
    for (const bool has_wheels : {false, true}) {
      EkfDriveOptions drive;
      drive.drive.odometry =
          has_wheels ? sim::OdometryKind::kInertialAndWheels : sim::OdometryKind::kInertial;
      let_sway(drive.drive);
      mismatch(drive.drive, factor);
      const std::vector<EkfDriveResult> results = drive_filter(drive, options, stop, world);
      const EkfConsistency summary = summarise(results);

      rows.in(fmt::format("ekf, sway, walk and noise {} times as assumed: {} ({} runs of {:.0f} m)",
                          factor, has_wheels ? "wheels and IMU" : "IMU alone", summary.runs,
                          summary.driven_m));
      const auto moving = static_cast<std::size_t>(
          std::lround(drive.drive.stationary_s / drive.drive.scan_interval_s));
      rows.state("mean NEES of the pose, stationary (3 is exact)", mean_nees(results, {1, moving}),
                 "");
      rows.state("mean NEES of the pose, moving (3)",
                 mean_nees(results, {moving, summary.mean_nees.size()}), "");
      rows.state("mean NEES of velocity and biases (5)", summary.overall_velocity_nees, "");
      rows.state("drift", summary.drift_percent, "%");
      rows.state("landmarks refused", 100.0 * summary.refused_share, "%");
      rows.state("restarts", static_cast<double>(summary.restarts), "");
    }
  }
}

void add_filter_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                     FrontendRows& rows) {
  const sim::TrunkField world = field(options.seed);
  struct Cell {
    const char* name;
    sim::OdometryKind odometry;
  };

  for (const Cell& cell : {Cell{"IMU alone", sim::OdometryKind::kInertial},
                           Cell{"wheels and IMU", sim::OdometryKind::kInertialAndWheels}}) {
    EkfDriveOptions drive;
    drive.drive.odometry = cell.odometry;
    let_sway(drive.drive);

    const std::vector<EkfDriveResult> results = drive_filter(drive, options, stop, world);
    const EkfConsistency summary = summarise(results);

    rows.in(fmt::format("ekf, simulated detections: {} ({} runs of {:.0f} m)", cell.name,
                        summary.runs, summary.driven_m));
    add_consistency_rows(drive, results, summary, rows);
    rows.at_most("drift", summary.drift_percent, "%", 0.5);
    rows.at_most("update p99", 1e3 * summary.update_p99_s, "ms", 1.0);
    rows.state("active landmarks", summary.mean_active_landmarks, "");
    rows.state("landmarks refused", 100.0 * summary.refused_share, "%");
  }

  add_form_rows(options, stop, world, rows);
  add_lidar_filter_rows(options, stop, rows);
}

}  // namespace understory::eval::experiments::frontend
