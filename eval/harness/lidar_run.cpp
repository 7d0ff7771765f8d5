#include "eval/harness/lidar_run.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "common/terminal/interrupt.hpp"
#include "sim/scenarios.hpp"
#include "sim/visible_landmarks.hpp"

namespace understory::eval::harness {
namespace {

constexpr double kLeastMotion = 0.1;  // [m] between keyframes that count
constexpr double kRange = 40.0;       // [m] as the ideal scans have
constexpr double kStep = 0.2;         // [m] from sweep to sweep, as the ideal scans have
constexpr std::uint32_t kLeastReturns = 5;
constexpr double kFindableRange = 25.0;  // [m] as eval frontend demands

double nees(const geometry::SE2& estimate, const Eigen::Matrix3d& covariance,
            const geometry::SE2& truth) {
  const Eigen::Vector3d error = (estimate.inverse() * truth).Log();
  return error.dot(covariance.llt().solve(error));
}

bool is_near(const geometry::SE2& a, const geometry::SE2& b) {
  return (a.translation() - b.translation()).norm() < kLeastMotion;
}

/// Scores states in order, by places: keyframe bases that count, numbered from 0.
class ChainScorer {
 public:
  ChainScorer(const ChainRun& run, const ChainTruth& truth) : run_(run), truth_(truth) {
    for (const MapAfterUpdate& state : run.states) {
      for (const model::KeyframePose& keyframe : state.keyframes) add_place(keyframe);
    }
    if (poses_.empty()) return;
    map_truth_.emplace(poses_, 0, truth.trunks_m, trunks_in_range());
  }

  LidarResult result() {
    if (!map_truth_) return {};
    std::optional<geometry::SE2> scored_at;
    for (std::size_t i = 0; i < run_.states.size(); ++i) {
      const geometry::SE2 here = truth_.world_T_vehicle(run_.updates[i].utime);
      if (scored_at && is_near(here, *scored_at)) continue;
      scored_at = here;
      score_state(run_.states[i]);
    }
    score_covariances();
    finish(result_.slam);
    finish(result_.ekf);
    result_.slam.score.completeness = map_completeness(
        result_.slam.trace.final_map.landmarks_m, *map_truth_, truth_.observation_count_of_trunk);
    return std::move(result_);
  }

 private:
  void add_place(const model::KeyframePose& keyframe) {
    if (place_of_.contains(keyframe.keyframe_sequence)) return;
    const geometry::SE2 pose = truth_.world_T_vehicle(keyframe.utime);
    auto& place = place_of_[keyframe.keyframe_sequence];
    if (!poses_.empty() && is_near(pose, poses_.back())) return;
    travelled_.push_back(poses_.empty()
                             ? 0.0
                             : travelled_.back() +
                                   (pose.translation() - poses_.back().translation()).norm());
    place = poses_.size();
    poses_.push_back(pose);
    ekf_of_place_.push_back(ekf_at(keyframe.utime));
  }

  std::vector<std::uint32_t> trunks_in_range() const {
    std::vector<std::uint32_t> result;
    for (std::uint32_t i = 0; i < truth_.trunks_m.size(); ++i) {
      const auto is_near_trunk = [&](const geometry::SE2& pose) {
        return (pose.translation() - truth_.trunks_m[i]).norm() < kRange;
      };
      if (std::any_of(poses_.begin(), poses_.end(), is_near_trunk)) result.push_back(i);
    }
    return result;
  }

  const model::EkfPose* ekf_at(model::Utime utime) const {
    const auto found = std::lower_bound(
        run_.ekf.begin(), run_.ekf.end(), utime,
        [](const model::EkfPose& pose, model::Utime time) { return pose.utime < time; });
    return found != run_.ekf.end() && found->utime == utime ? &*found : nullptr;
  }

  void score_state(const MapAfterUpdate& state) {
    metrics::MapState map;
    metrics::MapState ekf;
    for (const model::KeyframePose& keyframe : state.keyframes) {
      const auto place = place_of_.at(keyframe.keyframe_sequence);
      if (!place) continue;
      map.poses.push_back({*place, keyframe.map_T_vehicle});
      if (const auto pose = ekf_pose(*place)) ekf.poses.push_back({*place, *pose});
    }
    for (const model::MapLandmark& landmark : state.landmarks)
      map.landmarks_m.push_back(landmark.position_m);
    score(std::move(map), result_.slam);
    score(std::move(ekf), result_.ekf);
  }

  /// In the gauge of its own pose at the first place.
  std::optional<geometry::SE2> ekf_pose(std::size_t place) const {
    const model::EkfPose* const first = ekf_of_place_.front();
    const model::EkfPose* const here = ekf_of_place_[place];
    if (first == nullptr || here == nullptr) return std::nullopt;
    return first->ekf_map_T_vehicle.inverse() * here->ekf_map_T_vehicle;
  }

  void score(metrics::MapState state, RunResult& result) const {
    if (state.poses.empty()) return;
    const metrics::ErrorSums errors = errors_of(state, *map_truth_);
    result.score.errors += errors;
    const std::size_t before = result.trace.final_map.poses.size();
    for (std::size_t i = before; i < state.poses.size(); ++i) {
      if (error_m(state.poses[i]) > kWrongPose_m) ++result.score.wrong_updates;
    }
    const double newest_m = error_m(state.poses.back());
    const double scans = travelled_[state.poses.back().scan] / kStep + kScansPerKeyframe;
    result.trace.states.push_back(
        {static_cast<std::size_t>(std::lround(scans)), errors.rpe_m(), errors.lpe_m(), newest_m});
    result.trace.final_map = std::move(state);
  }

  double error_m(const metrics::PoseEstimate& pose) const {
    return (pose.map_T_vehicle.translation() - map_truth_->map_T_vehicle(pose.scan).translation())
        .norm();
  }

  void score_covariances() {
    for (const model::MapUpdate& update : run_.updates) {
      const auto found = place_of_.find(update.keyframe_sequence);
      if (update.status != model::MapUpdateStatus::kUpdated || found == place_of_.end()) continue;
      // The first place is the frame itself.
      if (!found->second || *found->second == 0) continue;
      const std::size_t place = *found->second;
      const geometry::SE2 real = map_truth_->map_T_vehicle(place);
      result_.slam.score.nees.emplace_back(place,
                                           nees(update.map_T_vehicle, update.covariance, real));
      const auto pose = ekf_pose(place);
      if (!pose) continue;
      result_.ekf.score.nees.emplace_back(place,
                                          nees(*pose, ekf_of_place_[place]->covariance, real));
    }
  }

  void finish(RunResult& result) const {
    RunScore& score = result.score;
    score.updates = static_cast<int>(
        std::count_if(run_.updates.begin(), run_.updates.end(),
                      [](const model::MapUpdate& update) { return metrics::localised(update); }));
    score.updates_possible = static_cast<int>(run_.sweeps / kScansPerKeyframe);
    score.keyframes_withheld = score.updates_possible - score.updates;
    score.ate_m = absolute_trajectory_error(result.trace.final_map.poses, *map_truth_);
    score.landmarks_in_range = map_truth_->trunks_in_range().size();
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      result.trace.true_path.push_back(map_truth_->map_T_vehicle(i));
    }
    for (const std::uint32_t trunk : map_truth_->trunks_in_range()) {
      result.trace.true_trunks_m.push_back(map_truth_->trunk_m(trunk));
    }
  }

  const ChainRun& run_;
  const ChainTruth& truth_;
  std::map<std::uint64_t, std::optional<std::size_t>>
      place_of_;                      ///< By keyframe; none = stationary.
  std::vector<geometry::SE2> poses_;  ///< True, of each place.
  std::vector<double> travelled_;
  std::vector<const model::EkfPose*> ekf_of_place_;
  std::optional<metrics::MapTruth> map_truth_;
  LidarResult result_;
};

/// Counts in how many sweeps each trunk could be found.
class ObservationCounter {
 public:
  explicit ObservationCounter(const sim::World& world) : world_(world) {
    for (std::uint32_t i = 0; i < world.trunks().size(); ++i) {
      number_of_[world.trunks()[i].object] = i;
    }
  }
  void add(const sim::SimulatedSweep& sweep, const sim::VehicleState& state,
           std::vector<std::uint32_t>& observation_count) const {
    for (const sim::VisibleTrunk& trunk :
         sim::visible_trunks(world_, sweep, state, kLeastReturns)) {
      if (trunk.range_m <= kFindableRange) ++observation_count[number_of_.at(trunk.object)];
    }
  }

 private:
  const sim::World& world_;
  std::map<sim::ObjectId, std::uint32_t> number_of_;
};

sim::SensorDrive sensor_drive(const sim::Drive& drive, std::uint64_t seed) {
  sim::ForestScenarioParameters forest;
  forest.path = drive.parameters().path.kind;
  forest.length_m = drive.parameters().path.length_m;
  sim::SensorSuite suite;
  suite.gnss.reset();
  sim::SpeedParameters speed;
  speed.cruise_mps = kStep * suite.lidar->revolutions_per_s;
  return {sim::forest_scenario(forest, drive.forest(), drive.world_T_vehicle().front(), seed),
          speed, suite, seed};
}

}  // namespace

LidarResult score_chain(const ChainRun& run, const ChainTruth& truth) {
  return ChainScorer(run, truth).result();
}

LidarResult run_lidar(const sim::Drive& drive, const std::filesystem::path& config_dir,
                      std::uint64_t seed, const std::atomic<bool>& stop) {
  sim::SensorDrive sensors = sensor_drive(drive, seed);
  ChainTruth truth;
  truth.world_T_vehicle = [&](model::Utime utime) {
    return sensors.state_at(utime).world_T_level();
  };
  for (const sim::TrueTrunk& trunk : sensors.world().trunks()) {
    truth.trunks_m.emplace_back(trunk.centre_m.head<2>());
  }
  truth.observation_count_of_trunk.assign(truth.trunks_m.size(), 0);
  const ObservationCounter observations(sensors.world());
  ChainOptions options;
  options.config_dir = config_dir;
  options.keep_states = true;
  options.progress = [&](double) {
    if (stop) throw terminal::Interrupted{};
  };
  options.on_sweep = [&](const sim::SimulatedSweep& sweep) {
    observations.add(sweep, sensors.state_at(sweep.raw.utime), truth.observation_count_of_trunk);
  };
  return score_chain(drive_chain(sensors, options), truth);
}

}  // namespace understory::eval::harness
