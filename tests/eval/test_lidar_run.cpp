// The scorer of the whole chain, with runs whose errors are known, and one short drive.
#include <cmath>

#include "eval/harness/lidar_run.hpp"
#include "tests/catch.hpp"
#include "tests/eval/small_drive.hpp"

using namespace understory;
using namespace understory::eval;

namespace {

constexpr model::Utime kKeyframe = 800'000;

/// Stands for three keyframes, then drives 1.6 m a keyframe along a tilted line.
geometry::SE2 truth_at(model::Utime utime) {
  const double driven = 1.6 * std::max(0.0, static_cast<double>(utime) / kKeyframe - 2.0);
  return geometry::SE2(5.0, -3.0, 0.7) * geometry::SE2(driven, 0.0, 0.0);
}

/// The map after each of `count` keyframes: off by `offset_m` to the left from the first moving
/// keyframe on. One trunk at its place, one 0.5 m off, in the frame of the first base.
eval::harness::ChainRun run_of(int count, double offset_m) {
  eval::harness::ChainRun run;
  eval::harness::MapAfterUpdate state;
  for (const Eigen::Vector2d& position : {Eigen::Vector2d(3, 4), Eigen::Vector2d(10, -2.5)}) {
    model::MapLandmark landmark;
    landmark.position_m = position;
    state.landmarks.push_back(landmark);
  }

  for (int k = 0; k < count; ++k) {
    model::MapUpdate update;
    update.keyframe_sequence = static_cast<std::uint64_t>(k);
    update.utime = k * kKeyframe;
    update.status = k == 0 ? model::MapUpdateStatus::kFirstMap : model::MapUpdateStatus::kUpdated;

    const geometry::SE2 moved = truth_at(0).inverse() * truth_at(update.utime);
    update.map_T_vehicle = k < 3 ? moved : moved * geometry::SE2(0.0, offset_m, 0.0);
    update.covariance = 0.01 * Eigen::Matrix3d::Identity();
    run.updates.push_back(update);
    state.keyframes.push_back(
        {update.keyframe_sequence, update.utime, update.map_T_vehicle, Eigen::Matrix3d::Zero()});
    run.states.push_back(state);

    // The filter has a frame of its own and no error.
    model::EkfPose ekf;
    ekf.utime = update.utime;
    ekf.ekf_map_T_vehicle = geometry::SE2(-1.0, 8.0, 2.0) * moved;
    ekf.covariance = 0.01 * Eigen::Matrix3d::Identity();
    run.ekf.push_back(ekf);
  }

  run.sweeps = 8 * static_cast<std::uint64_t>(count);
  return run;
}

eval::harness::ChainTruth truth() {
  eval::harness::ChainTruth result;
  result.world_T_vehicle = truth_at;
  const geometry::SE2 world_T_map = truth_at(0);
  result.trunks_m = {world_T_map * Eigen::Vector2d(3, 4), world_T_map * Eigen::Vector2d(10, -2),
                     world_T_map * Eigen::Vector2d(-20, 0), world_T_map * Eigen::Vector2d(0, 200)};
  result.observation_count_of_trunk = {100, 100, 100, 3};
  return result;
}

}  // namespace

TEST_CASE("A stationary vehicle counts once, and errors are those of all states", "[lidar]") {
  const eval::harness::LidarResult result = score_chain(run_of(6, 0.2), truth());
  const eval::harness::RunScore& slam = result.slam.score;

  // Places: the stationary one without error, and three off by 0.2 m; states with 1 to 4 of them.
  CHECK(slam.errors.poses == 1 + 2 + 3 + 4);
  CHECK(slam.errors.rpe_m() == Approx(0.2 * (1 + 2 + 3) / 10.0));
  CHECK(slam.errors.lpe_m() == Approx(0.25));
  CHECK(slam.updates == 6);
  CHECK(slam.updates_possible == 6);
  CHECK(slam.wrong_updates == 0);
  CHECK(slam.landmarks_in_range == 3);

  // Three trunks were observed well, one of them is not in the map.
  CHECK(slam.completeness.well_seen == 3);
  CHECK(slam.completeness.recalled == 2);
  CHECK(slam.completeness.without_trunk == 0);

  REQUIRE(slam.nees.size() == 3);
  for (const auto& [place, nees] : slam.nees) CHECK(nees == Approx(4.0));
  CHECK(result.slam.trace.true_path.size() == 4);
}

TEST_CASE("The filter is scored in its own frame", "[lidar]") {
  const eval::harness::LidarResult result = score_chain(run_of(6, 0.2), truth());
  CHECK(result.ekf.score.errors.poses == 10);
  CHECK(result.ekf.score.errors.rpe_m() < 1e-9);
  CHECK(result.ekf.score.ate_m < 1e-9);
  CHECK(result.slam.score.ate_m > 0.01);
}

TEST_CASE("Updates that are wrong or refused are counted", "[lidar]") {
  CHECK(score_chain(run_of(6, 1.5), truth()).slam.score.wrong_updates == 3);
  eval::harness::ChainRun run = run_of(6, 0.2);
  // Not sure: the map stays as it was, and counts once more.
  run.updates[4].status = model::MapUpdateStatus::kNotSure;
  run.states[4] = run.states[3];
  run.states[5].keyframes.erase(run.states[5].keyframes.begin() + 4);
  const eval::harness::RunScore slam = score_chain(run, truth()).slam.score;
  CHECK(slam.updates == 5);
  CHECK(slam.errors.poses == 1 + 2 + 2 + 3);
  CHECK(slam.nees.size() == 2);
}

TEST_CASE("No map gives no score", "[lidar]") {
  CHECK(score_chain(eval::harness::ChainRun{}, truth()).slam.trace.states.empty());
}
