// The errors of a whole chain's poses.
#include "eval/harness/chain_drive.hpp"
#include "tests/catch.hpp"

using namespace understory;

TEST_CASE("Poses in two maps are compared each in its own frame", "[eval]") {
  std::vector<eval::metrics::StampedPose> truth;
  eval::harness::ChainRun run;
  const geometry::SE2 second_T_first(40.0, -7.0, 1.2);
  for (int k = 0; k < 40; ++k) {
    const geometry::SE2 world_T_vehicle(0.5 * k, 0.1 * k, 0.05 * k);
    truth.push_back({100'000 * k, world_T_vehicle});
    const bool is_second = k >= 20;
    model::SlamPose pose;
    pose.utime = 100'000 * k;
    pose.map_id = is_second ? 2 : 1;
    pose.submap_T_vehicle = is_second ? second_T_first * world_T_vehicle : world_T_vehicle;
    run.slam.push_back(pose);
    model::MapUpdate update;
    update.utime = pose.utime;
    update.map_id = pose.map_id;
    update.status = model::MapUpdateStatus::kUpdated;
    update.map_T_vehicle = pose.submap_T_vehicle;
    run.updates.push_back(update);
  }
  run.truth = truth;

  CHECK(eval::harness::count_maps(run.slam) == 2);
  const auto error = eval::harness::trajectory_error(run.slam, truth);
  CHECK(error.poses == 40);
  CHECK(error.largest_m < 1e-9);
  CHECK(error.end_m < 1e-9);
  CHECK(eval::harness::wrong_updates(run) == 0);
  CHECK(eval::harness::trajectory_error(eval::harness::poses_of(run.slam), truth).largest_m > 1.0);

  run.updates.back().map_T_vehicle = geometry::SE2(3.0, 0.0, 0.0) * second_T_first;
  CHECK(eval::harness::wrong_updates(run) > 0);
}
