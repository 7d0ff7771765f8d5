// run_oracle of eval/harness/run.hpp.
#include <algorithm>
#include <cmath>

#include "common/terminal/interrupt.hpp"
#include "eval/harness/run.hpp"
#include "eval/metrics/oracle.hpp"

namespace understory::eval::harness {
namespace {

void add_scan(metrics::BatchOracle& oracle, const sim::SimulatedScan& scan) {
  std::vector<Eigen::Vector2d> positions;
  positions.reserve(scan.scan.detections.size());
  for (const model::Detection& detection : scan.scan.detections) {
    positions.emplace_back(detection.position_m.head<2>());
  }
  oracle.add(positions, scan.trunks);
}

/// The oracle's frame is that of scan 0; the map's is that of its first base.
metrics::MapState state_of(const metrics::BatchOracle& oracle, const StateMark& mark) {
  metrics::MapState state;
  const geometry::SE2 map_T_first = oracle.first_T_vehicle(mark.bases.front()).inverse();
  for (const std::size_t base : mark.bases) {
    state.poses.push_back({base, map_T_first * oracle.first_T_vehicle(base)});
  }
  for (const std::uint32_t trunk : mark.trunks) {
    const int landmark = oracle.landmark_of(trunk);
    // A trunk that was never detected can be nearest to a false landmark: it has no estimate.
    if (landmark >= 0) state.landmarks_m.push_back(map_T_first * oracle.landmarks_m()[landmark]);
  }
  return state;
}

template <typename MarkOf>
RunResult run(const RecordedDrive& recorded, std::span<const std::size_t> scans_of_state,
              MarkOf mark_of, const std::atomic<bool>& stop) {
  RunResult result;
  metrics::BatchOracle oracle;
  std::optional<metrics::MapTruth> truth;
  const sim::SensorParameters& sensor = recorded.drive.parameters().sensor;
  const double sigma_m = sensor.stated_factor * sensor.position_sigma_m;

  for (std::size_t i = 0; i < scans_of_state.size(); ++i) {
    while (oracle.scans() < scans_of_state[i]) {
      if (stop) throw terminal::Interrupted{};
      add_scan(oracle, recorded.scans[oracle.scans()]);
    }

    oracle.solve();
    const StateMark mark = mark_of(i, oracle);
    if (!truth) truth.emplace(recorded.drive, mark.bases.front());

    metrics::MapState state = state_of(oracle, mark);
    const metrics::ErrorSums errors = errors_of(state, *truth);
    result.score.errors += errors;

    const metrics::PoseEstimate& newest = state.poses.back();
    const geometry::SE2 true_pose = truth->map_T_vehicle(newest.scan);
    result.trace.states.push_back(
        {mark.scans, errors.rpe_m(), errors.lpe_m(),
         (newest.map_T_vehicle.translation() - true_pose.translation()).norm()});

    if (sigma_m > 0.0 && mark.bases.front() == 0 && newest.scan > 0) {
      const Eigen::Vector3d error = (newest.map_T_vehicle.inverse() * true_pose).Log();
      result.score.nees.emplace_back(
          newest.scan / kScansPerKeyframe,
          error.dot(oracle.covariance(newest.scan, sigma_m).llt().solve(error)));
    }

    result.trace.final_map = std::move(state);
  }

  if (!truth) return result;
  result.score.updates = static_cast<int>(result.trace.final_map.poses.size());
  result.score.updates_possible = static_cast<int>(recorded.scans.size() / kScansPerKeyframe);
  result.score.ate_m = absolute_trajectory_error(result.trace.final_map.poses, *truth);
  result.score.completeness = map_completeness(result.trace.final_map.landmarks_m, *truth,
                                               recorded.observation_count_of_trunk);
  result.score.landmarks_in_range = truth->trunks_in_range().size();
  return result;
}

}  // namespace

RunResult run_oracle(const RecordedDrive& recorded, std::span<const StateMark> marks,
                     const std::atomic<bool>& stop) {
  std::vector<std::size_t> scans;
  for (const StateMark& mark : marks) scans.push_back(mark.scans);
  const auto mark_of = [&](std::size_t i, const metrics::BatchOracle&) { return marks[i]; };
  return run(recorded, scans, mark_of, stop);
}

RunResult run_oracle(const RecordedDrive& recorded, const std::atomic<bool>& stop,
                     std::uint32_t min_observation_count) {
  std::vector<std::size_t> scans;
  for (std::size_t n = kScansPerKeyframe; n <= recorded.scans.size(); n += kScansPerKeyframe) {
    scans.push_back(n);
  }
  const auto mark_of = [&](std::size_t i, const metrics::BatchOracle& oracle) {
    StateMark mark;
    mark.scans = scans[i];
    for (std::size_t base = 0; base < mark.scans; base += kScansPerKeyframe) {
      mark.bases.push_back(base);
    }
    for (std::size_t k = 0; k < oracle.trunks().size(); ++k) {
      if (oracle.observation_count()[k] >= min_observation_count)
        mark.trunks.push_back(oracle.trunks()[k]);
    }
    return mark;
  };
  return run(recorded, scans, mark_of, stop);
}

}  // namespace understory::eval::harness
