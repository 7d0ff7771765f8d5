// The whole chain on simulated drives: accuracy, time, and what faults do to it.
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>

#include "eval/experiments/frontend/frontend.hpp"
#include "eval/harness/chain_drive.hpp"

namespace understory::eval::experiments::frontend {
namespace {

double quantile_ms(std::vector<float> values, double part) {
  if (values.empty()) return 0.0;
  const auto index = static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + index, values.end());
  return values[static_cast<std::size_t>(index)];
}

std::size_t accepted(const harness::ChainRun& run) {
  return static_cast<std::size_t>(
      std::count_if(run.updates.begin(), run.updates.end(),
                    [](const model::MapUpdate& update) { return metrics::localised(update); }));
}

/// Seconds of the drive over seconds of processor.
double real_time_factor(const harness::ChainRun& run) {
  double busy_s = 0.0;
  for (const auto& [service, time] : run.times) busy_s += time.total_s;
  return run.simulated_s / std::max(busy_s, 1e-9);
}

void add_slam_rows(const harness::ChainRun& run, const harness::TrajectoryError& slam,
                   std::optional<double> ate_target_m, FrontendRows& rows) {
  if (ate_target_m) {
    rows.at_most("SLAM_POSE ATE", slam.ate_rms_m, "m", *ate_target_m);
  } else {
    rows.state("SLAM_POSE ATE", slam.ate_rms_m, "m");
  }
  if (const std::size_t maps = harness::count_maps(run.slam); maps > 1) {
    rows.state("SLAM_POSE: maps, each aligned by itself", static_cast<double>(maps), "");
  }
  rows.state("SLAM_POSE largest error", slam.largest_m, "m");
  rows.state("SLAM_POSE drift", 100.0 * slam.end_m / std::max(slam.driven_m, 1.0), "%");

  const harness::PoseConsistency said = harness::pose_consistency(run.slam, run.truth);
  rows.state("SLAM_POSE, first pose held: mean NEES (3)", said.mean_nees, "");
  rows.state("SLAM_POSE, first pose held: error at the end", said.end_error_m, "m");
  rows.state("SLAM_POSE, first pose held: standard deviation reported for it", said.end_sigma_m,
             "m");
}

}  // namespace

void add_time_rows(const harness::ChainRun& run, FrontendRows& rows) {
  rows.at_least("real-time factor of the chain (one core)", real_time_factor(run), "x", 10.0);
  for (const auto& [service, time] : run.times) {
    rows.state(service + ": share of the drive's time",
               100.0 * time.total_s / std::max(run.simulated_s, 1e-6), "%");
    rows.state(service + ": message p99", quantile_ms(time.calls_ms, 0.99), "ms");
  }
}

void add_chain_rows(const harness::ChainRun& run, std::optional<double> ate_target_m,
                    FrontendRows& rows) {
  const harness::TrajectoryError slam = harness::trajectory_error(run.slam, run.truth);
  const harness::TrajectoryError ekf =
      harness::trajectory_error(harness::poses_of(run.ekf), run.truth);
  const harness::TrajectoryError reckoned = harness::trajectory_error(run.dead_reckoned, run.truth);
  const harness::TrajectoryError summed = harness::trajectory_error(run.odometry, run.truth);

  // A configuration without the filter has no figures of it; a filter without poses has missed.
  const bool has_ekf = run.times.contains("ekf");
  rows.state("driven", has_ekf ? ekf.driven_m : slam.driven_m, "m");
  if (slam.poses >= 2 || ate_target_m) add_slam_rows(run, slam, ate_target_m, rows);
  if (!run.coasting.empty()) {
    const std::vector<model::SlamPose> live = harness::live_poses(run);
    rows.state("SLAM_POSE, COASTING included: ATE",
               harness::trajectory_error(live, run.truth).ate_rms_m, "m");
    rows.state("SLAM_POSE, COASTING included: mean NEES (3)",
               harness::pose_consistency(live, run.truth).mean_nees, "");
  }
  const harness::TrajectoryError of_map =
      harness::trajectory_error(harness::poses_of(run.keyframes), run.truth);
  if (of_map.poses >= 2) rows.state("map's keyframes at the end, ATE", of_map.ate_rms_m, "m");

  if (has_ekf) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    const bool has_poses = ekf.poses >= 2;
    rows.state("EKF_POSE ATE", has_poses ? ekf.ate_rms_m : kNone, "m");
    rows.at_most("EKF_POSE drift",
                 has_poses ? 100.0 * ekf.end_m / std::max(ekf.driven_m, 1.0) : kNone, "%", 0.5);
  }
  // A laser alone gives neither; no error is not none.
  if (reckoned.poses > 0) rows.state("RAW_POSE ATE", reckoned.ate_rms_m, "m");
  if (summed.poses > 0) rows.state("ODOMETRY summed, ATE", summed.ate_rms_m, "m");

  rows.at_most("wrong updates", static_cast<double>(wrong_updates(run)), "", 0.0);
  rows.state("keyframes accepted", static_cast<double>(accepted(run)), "");
  rows.state("keyframes offered", static_cast<double>(run.updates.size()), "");
  const auto share = [&](std::size_t poses) {
    return 100.0 * static_cast<double>(poses) /
           static_cast<double>(std::max<std::uint64_t>(run.sweeps, 1));
  };
  rows.state("SLAM_POSE share of sweeps", share(run.slam.size()), "%");
  rows.state("SLAM_POSE COASTING, share of sweeps", share(run.coasting.size()), "%");
  add_time_rows(run, rows);
}

nlohmann::json trace_of(const harness::ChainRun& run) {
  const auto points = [](const std::vector<metrics::StampedPose>& poses, model::Utime apart) {
    nlohmann::json out = nlohmann::json::array();
    model::Utime next = std::numeric_limits<model::Utime>::min();
    for (const metrics::StampedPose& pose : poses) {
      if (pose.utime < next) continue;
      next = pose.utime + apart;
      out.push_back({1e-6 * static_cast<double>(pose.utime), pose.pose.x(), pose.pose.y(),
                     pose.pose.theta()});
    }
    return out;
  };

  nlohmann::json landmarks = nlohmann::json::array();
  for (const model::MapLandmark& landmark : run.landmarks) {
    landmarks.push_back({landmark.position_m.x(), landmark.position_m.y(), landmark.radius_m,
                         static_cast<int>(landmark.kind)});
  }

  nlohmann::json counts = nlohmann::json::array();
  for (const model::EkfPose& pose : run.ekf) {
    counts.push_back({1e-6 * static_cast<double>(pose.utime), pose.landmarks_used});
  }

  return {{"truth", points(run.truth, 100'000)},
          {"raw", points(run.dead_reckoned, 100'000)},
          {"ekf", points(harness::poses_of(run.ekf), 0)},
          {"slam", points(harness::poses_of(run.slam), 0)},
          {"landmarks", landmarks},
          {"landmarks_used", counts}};
}

}  // namespace understory::eval::experiments::frontend
