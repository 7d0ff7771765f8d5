#include "eval/experiments/few_landmarks/few_landmarks_drive.hpp"

#include <algorithm>
#include <memory>
#include <numeric>

#include "eval/harness/input_log.hpp"
#include "eval/metrics/victoria_park_score.hpp"
#include "sim/scenarios.hpp"

namespace understory::eval::experiments::few_landmarks {
namespace {

sim::Scenario scenario_of(const FewLandmarksDrive& plan, std::uint64_t seed) {
  sim::ForestScenarioParameters parameters;
  parameters.forest.min_distance_m = plan.spacing_m;
  parameters.forest.tile_reach = 2;
  parameters.world.bushes_per_hectare = 0.0;
  parameters.world.people = plan.walkers;
  parameters.length_m = plan.length_m;
  parameters.laps = plan.laps;
  return sim::forest_scenario(parameters, seed);
}

sim::SensorSuite suite_of(const FewLandmarksDrive& plan) {
  sim::SensorSuite suite;
  suite.imu.reset();
  suite.gnss.reset();
  suite.lidar.reset();
  suite.wheels->scale_sigma *= plan.wheel_scale;
  suite.wheels->speed_sigma_mps *= plan.wheel_scale;
  suite.wheels->steering_sigma_rad *= plan.wheel_scale;
  suite.wheels->steering_offset_sigma_rad *= plan.wheel_scale;
  // At the vehicle's origin: a scan taken at one instant is in the vehicle's frame.
  suite.planar_laser.emplace();
  suite.planar_laser->revolution_s = 0.0;
  suite.planar_laser->rate_hz = plan.rate_hz;
  suite.planar_laser->vehicle_T_sensor = Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.0, 0.8));
  return suite;
}

LiveErrors errors_of_slam(const harness::ChainRun& run) {
  const std::vector<model::SlamPose> poses = harness::live_poses(run);
  const harness::TrajectoryError error = harness::trajectory_error(poses, run.truth);
  return {error.poses, error.ate_rms_m, error.largest_m,
          harness::pose_consistency(poses, run.truth).mean_nees};
}

LiveErrors errors_of_filter(const harness::ChainRun& run) {
  std::vector<model::SlamPose> poses;
  for (const model::EkfPose& one : run.ekf) {
    model::SlamPose pose;
    pose.utime = one.utime;
    pose.submap_T_vehicle = one.ekf_map_T_vehicle;
    pose.covariance = one.covariance;
    poses.push_back(pose);
  }
  const harness::TrajectoryError error = harness::trajectory_error(poses, run.truth);
  return {error.poses, error.ate_rms_m, error.largest_m,
          harness::pose_consistency(poses, run.truth).mean_nees};
}

/// The vehicle's own: laser and wheels of suite_of().
constexpr const char* kInput = "[wheels]\nwheelbase_m = 2.7\nencoder_left_m = 0.0\n";

/// Keyframes' poses when they came, against the truth.
double updates_ate_m(const harness::ChainRun& run) {
  std::vector<model::SlamPose> poses;
  for (const model::MapUpdate& update : run.updates) {
    if (!metrics::localised(update)) continue;
    model::SlamPose pose;
    pose.utime = update.utime;
    pose.map_id = update.map_id;
    pose.submap_T_vehicle = update.map_T_vehicle;
    poses.push_back(pose);
  }
  return harness::trajectory_error(poses, run.truth).ate_rms_m;
}

double mean(const std::vector<std::size_t>& values) {
  const auto sum = std::accumulate(values.begin(), values.end(), std::size_t{0});
  return values.empty() ? 0.0 : static_cast<double>(sum) / static_cast<double>(values.size());
}

}  // namespace

FewLandmarksScore drive(const FewLandmarksDrive& plan, std::uint64_t seed,
                        const std::function<void(double done)>& progress) {
  sim::SpeedParameters speed;
  speed.cruise_mps = plan.speed_mps;
  speed.standstill_s = 2.0;
  sim::SensorDrive sensors(scenario_of(plan, seed), speed, suite_of(plan), seed);
  harness::InputLog recorder(plan.log);

  harness::ChainOptions options;
  options.config_dir = plan.config_dir;
  options.toml_instead = {{"lidar_imu_input", kInput}};
  options.without = {"existence_tracker", "loop_closer"};
  options.meddle = [&](harness::RawMessage message) {
    progress(1e-6 * static_cast<double>(message.utime) / sensors.motion().duration_s());
    recorder.add(message.utime, message.channel, message.bytes);
    return std::vector{std::move(message)};
  };
  const harness::ChainRun run = drive_chain(sensors, options);
  for (const metrics::StampedPose& pose : run.truth) recorder.add_truth(pose.utime, pose.pose);
  recorder.finish();

  FewLandmarksScore score;
  score.scans = run.detections.size();
  score.landmarks = mean(run.detections);
  score.updates = run.updates.size();
  score.accepted = static_cast<std::size_t>(std::ranges::count_if(run.updates, metrics::localised));
  score.wrong = wrong_updates(run);
  score.maps = harness::count_maps(run.slam);
  score.coasting = run.coasting.size();
  score.slam = errors_of_slam(run);
  score.ekf = errors_of_filter(run);
  score.odometry_ate_m = harness::trajectory_error(run.odometry, run.truth).ate_rms_m;
  score.updates_ate_m = updates_ate_m(run);
  score.keyframes_ate_m =
      harness::trajectory_error(harness::poses_of(run.keyframes), run.truth).ate_rms_m;
  return score;
}

}  // namespace understory::eval::experiments::few_landmarks
