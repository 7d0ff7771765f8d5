#include "eval/experiments/gaps/gap_drive.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <utility>

#include "common/terminal/interrupt.hpp"
#include "eval/harness/chain_drive.hpp"
#include "sim/scenarios.hpp"

namespace understory::eval::experiments::gaps {
namespace {

/// When a gap may begin [s]: the vehicle has driven for some seconds.
constexpr double kEarliest_s = 27.0;
constexpr double kLatest_s = 42.0;
/// A micrometre, a microradian: a map's first poses may be exact.
constexpr double kExact = 1e-12;

/// A pose of either channel.
struct SaidPose {
  model::Utime utime = 0;
  geometry::SE2 frame_T_vehicle;
  Eigen::Matrix3d covariance;
  std::uint32_t frame = 0;
  std::uint64_t resets = 0;
};

std::vector<SaidPose> said(std::span<const model::EkfPose> poses) {
  std::vector<SaidPose> result;
  for (const model::EkfPose& pose : poses)
    result.push_back({pose.utime, pose.ekf_map_T_vehicle, pose.covariance, 0, pose.reset_counter});
  return result;
}

std::vector<SaidPose> said(std::span<const model::SlamPose> poses) {
  std::vector<SaidPose> result;
  for (const model::SlamPose& pose : poses)
    result.push_back(
        {pose.utime, pose.map_T_vehicle(), pose.covariance, pose.map_id, pose.reset_counter});
  return result;
}

/// A said pose, and where it should be in its frame, which the frame's first pose ties to the
/// truth.
struct JudgedPose {
  SaidPose said;
  geometry::SE2 truth;
  geometry::SE2 should;

  Eigen::Vector2d error_m() const {
    return said.frame_T_vehicle.translation() - should.translation();
  }
  double nees() const {
    const Eigen::Vector3d off = (said.frame_T_vehicle.inverse() * should).coordinates();
    const Eigen::Matrix3d covariance = said.covariance + kExact * Eigen::Matrix3d::Identity();
    return off.dot(covariance.llt().solve(off));
  }
};

std::vector<JudgedPose> judged(std::span<const SaidPose> poses,
                               std::span<const metrics::StampedPose> truth) {
  std::vector<JudgedPose> result;
  geometry::SE2 frame_T_world;
  for (const SaidPose& pose : poses) {
    const auto is = metrics::pose_at(truth, pose.utime);
    if (!is) continue;
    if (result.empty() || result.back().said.frame != pose.frame)
      frame_T_world = pose.frame_T_vehicle * is->inverse();
    result.push_back({pose, *is, frame_T_world * *is});
  }
  return result;
}

/// Between two jumps all errors are of one frame: each such stretch is aligned by itself.
double rms_by_stretches(std::span<const JudgedPose> poses) {
  double squared = 0.0;
  std::size_t count = 0;
  for (auto from = poses.begin(); from != poses.end();) {
    const auto to = std::find_if(from, poses.end(), [&](const JudgedPose& pose) {
      return pose.said.frame != from->said.frame || pose.said.resets != from->said.resets;
    });
    std::vector<metrics::StampedPose> estimate, truth;
    for (auto pose = from; pose != to; ++pose) {
      estimate.push_back({pose->said.utime, pose->said.frame_T_vehicle});
      truth.push_back({pose->said.utime, pose->truth});
    }
    const harness::TrajectoryError error = harness::trajectory_error(estimate, truth);
    squared += static_cast<double>(error.poses) * error.ate_rms_m * error.ate_rms_m;
    count += error.poses;
    from = to;
  }
  return std::sqrt(squared / std::max(1.0, static_cast<double>(count)));
}

PosesAroundGap around(std::span<const SaidPose> poses, std::span<const metrics::StampedPose> truth,
                      double from_s, double to_s) {
  const auto at_s = [](const JudgedPose& pose) {
    return 1e-6 * static_cast<double>(pose.said.utime);
  };
  PosesAroundGap result;
  std::vector<JudgedPose> all = judged(poses, truth);
  const auto after =
      std::ranges::find_if(all, [&](const auto& pose) { return at_s(pose) >= to_s; });
  const auto inside =
      std::find_if(all.begin(), after, [&](const auto& pose) { return at_s(pose) >= from_s; });
  if (after != all.end() && inside != all.begin()) {
    const JudgedPose& before = *std::prev(inside);
    result.goes_on = true;
    result.waited_s = at_s(*after) - to_s;
    result.is_new_map = after->said.frame != before.said.frame;
    result.is_announced = result.is_new_map || after->said.resets != before.said.resets;
    if (!result.is_new_map) {
      result.step_m = (after->error_m() - before.error_m()).norm();
      result.nees = after->nees();
    }
  }
  all.erase(inside, after);
  result.rms_m = rms_by_stretches(all);
  return result;
}

}  // namespace

std::vector<Gap> all_gaps() {
  const std::pair<const char*, const char*> services[] = {
      {"input", "lidar_imu_input"}, {"extractor", "landmark_extractor"},
      {"associator", "associator"}, {"filter", "ekf"},
      {"keyframer", "keyframer"},   {"mapper", "geoslam_mapper"},
      {"all processes", "all"}};
  const std::pair<const char*, const char*> sensors[] = {
      {"IMU", "RAW_IMU"}, {"wheels", "RAW_WHEELS"}, {"LIDAR", "RAW_SWEEP"}};
  std::vector<Gap> gaps{{"none", "", "", 0.0}};
  for (const double seconds : {1.1, 3.0, 6.0, 30.0}) {
    for (const auto& [what, service] : services) gaps.push_back({what, service, "", seconds});
    for (const auto& [what, channel] : sensors) gaps.push_back({what, "", channel, seconds});
  }
  return gaps;
}

GapScore drive(const GapDrive& drive, const Gap& gap, std::uint64_t seed) {
  sim::ForestScenarioParameters forest;
  forest.length_m = drive.length_m;
  sim::SensorSuite suite;
  suite.gnss.reset();
  if (drive.is_vlp16) {
    suite.lidar->elevations_rad = sim::beam_elevations_rad(sim::LidarModel::kVlp16);
    suite.lidar->columns = 900;
  }
  sim::SensorDrive sensors(sim::forest_scenario(forest, seed), sim::SpeedParameters{}, suite, seed);

  std::mt19937_64 random(seed);
  const double from_s = std::uniform_real_distribution<double>(kEarliest_s, kLatest_s)(random);
  const double to_s = from_s + gap.seconds;
  harness::ChainOptions options;
  options.config_dir = drive.config_dir;
  options.progress = [](double) { terminal::throw_if_interrupted(); };
  if (!gap.service.empty())
    options.pauses = {{gap.service == "all" ? "" : gap.service, from_s, to_s}};
  options.meddle = [&](harness::RawMessage message) -> std::vector<harness::RawMessage> {
    const double at_s = 1e-6 * static_cast<double>(message.utime);
    if (message.channel == gap.channel && at_s >= from_s && at_s < to_s) return {};
    return {std::move(message)};
  };

  const harness::ChainRun run = drive_chain(sensors, options);
  return {around(said(run.ekf), run.truth, from_s, to_s),
          around(said(run.slam), run.truth, from_s, to_s)};
}

}  // namespace understory::eval::experiments::gaps
