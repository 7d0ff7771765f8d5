// Associator and filter by themselves, on simulated detections.
#include <fmt/format.h>

#include <cmath>

#include "eval/ekf_consistency.hpp"
#include "eval/frontend.hpp"
#include "eval/parallel.hpp"
#include "eval/run.hpp"
#include "eval/tracking.hpp"

namespace understory::eval {
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

/// Of the scans from `first` on.
double share_in_band(const EkfConsistency& summary, std::size_t first) {
  std::size_t inside = 0;
  for (std::size_t i = first; i < summary.mean_nees.size(); ++i) {
    if (summary.mean_nees[i] >= summary.band_low && summary.mean_nees[i] <= summary.band_high) {
      ++inside;
    }
  }
  const std::size_t count = summary.mean_nees.size() - std::min(first, summary.mean_nees.size());
  return static_cast<double>(inside) / static_cast<double>(std::max<std::size_t>(1, count));
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
    run_in_parallel(runs, options.jobs, "tracking", stop, [&](std::size_t run) {
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
    std::vector<EkfDriveResult> results(static_cast<std::size_t>(options.runs));
    run_in_parallel(results.size(), options.jobs, "filter", stop, [&](std::size_t run) {
      results[run] = run_ekf_drive(drive, world, options.seed * 1000 + run);
    });
    const EkfConsistency summary = summarise(results);
    rows.in(fmt::format("ekf, simulated detections: {} ({} runs of {:.0f} m)", cell.name,
                        summary.runs, summary.driven_m));
    // While the vehicle stands its error is smaller than any motion noise says.
    const auto moving =
        static_cast<std::size_t>(std::lround(drive.drive.standing_s / drive.drive.scan_interval_s));
    rows.between("NEES of the pose inside its 95 % band, moving",
                 100.0 * share_in_band(summary, moving), "%", 90.0, 99.0);
    rows.state("the same, with the standing at the start", 100.0 * summary.share_in_band, "%");
    rows.state("mean NEES of the pose (3 is exact)", summary.overall_nees, "");
    rows.state("mean NEES of velocity and biases (5)", summary.overall_velocity_nees, "");
    rows.at_most("drift", summary.drift_percent, "%", 0.5);
    rows.at_most("update p99", 1e3 * summary.update_p99_s, "ms", 1.0);
    rows.state("active landmarks", summary.mean_active_landmarks, "");
    rows.state("landmarks refused", 100.0 * summary.refused_share, "%");
  }
}

}  // namespace understory::eval
