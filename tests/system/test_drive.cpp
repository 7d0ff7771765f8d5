#include "common/map_file/map_file.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"
#include "tests/system/stack.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

TEST_CASE("processes on the bus localise a vehicle and stop cleanly", "[system]") {
  const auto drive = test::short_drive(11);
  test::Stack stack;
  REQUIRE(stack.wait_for_processes());
  stack.drive(drive, 0, drive.size());
  CHECK(stack.wait_until([&] { return stack.newest_pose() >= drive.utime(drive.size() - 1); }));

  CHECK(stack.updates(model::MapUpdateStatus::kFirstMap) == 1);
  // Poses between keyframes may come before the update of the keyframe that they follow.
  CHECK(stack.wait_until(
      [&] { return stack.updates(model::MapUpdateStatus::kUpdated) >= drive.size() / 8 - 2; }));
  const double error_m = largest_error_m(stack, drive);
  CHECK(error_m >= 0.0);
  CHECK(error_m < 0.25);
  CHECK(stack.refused == 0);

  const auto ending = stack.stop();
  CHECK(ending.known);
  CHECK(ending.signal == 0);
  CHECK(ending.exit_code == 0);
  // What does not end within its 0.9 s is killed, and the report names it.
  CHECK_THAT(test::read_text(stack.report()),
             Contains("\"text\": \"ended\"") && !Contains("does not end"));
}

TEST_CASE("a killed process comes back with its state", "[system]") {
  const auto drive = test::short_drive(12);
  for (const std::string victim :
       {"keyframer", "geoslam_mapper", "loop_closer", "existence_tracker"}) {
    test::Stack stack;
    REQUIRE(stack.wait_for_processes());
    const std::size_t half = drive.size() / 2;
    stack.drive(drive, 0, half);
    REQUIRE(stack.wait_until([&] { return stack.newest_pose() >= drive.utime(half - 12); }));
    const pid_t killed = stack.pid(victim);
    const std::size_t poses_before = stack.poses.size();

    ::kill(killed, SIGKILL);
    stack.drive(drive, half, drive.size());
    CAPTURE(victim);
    CHECK(stack.wait_until([&] { return stack.pid(victim) != killed; }));
    CHECK(stack.wait_until([&] { return stack.newest_pose() >= drive.utime(drive.size() - 12); }));
    CHECK(stack.updates(model::MapUpdateStatus::kFirstMap) == 1);  // The map was not begun anew.
    CHECK(stack.poses.size() > poses_before + half / 2);

    CHECK(largest_error_m(stack, drive, poses_before) < 0.25);
    stack.stop();
    CHECK_THAT(test::read_text(stack.report()), Contains("killed by signal 9") &&
                                                    Contains("\"restarts\": 1") &&
                                                    !Contains("given up"));
  }
}

TEST_CASE("launch --map --localisation-only keeps to the map, through a kill as well", "[system]") {
  const auto drive = test::short_drive(13);
  const TemporaryDirectory directory;
  const std::string file = directory / "survey.gpkg";
  map_file::StoredMap survey;
  for (const Eigen::Vector2d& trunk : drive.forest().trunks_m) {
    map_file::StoredLandmark one;
    one.landmark.id = map_file::landmark_id(1, survey.landmarks.size() + 1);
    one.landmark.position_m = trunk;
    one.landmark.covariance_m2 = 1e-4 * Eigen::Matrix2d::Identity();
    survey.landmarks.push_back(one);
  }
  map_file::create_map_file(file, {&survey, 1}, {});
  const Bytes before = read_bytes(file);

  test::Stack stack({"--map", file, "--localisation-only"});
  REQUIRE(stack.wait_for_processes());
  const std::size_t half = drive.size() / 2;
  stack.drive(drive, 0, half);
  REQUIRE(stack.wait_until([&] { return stack.newest_pose() >= drive.utime(half - 12); }));
  const pid_t killed = stack.pid("geoslam_mapper");
  ::kill(killed, SIGKILL);
  stack.drive(drive, half, drive.size());
  CHECK(stack.wait_until([&] { return stack.newest_pose() >= drive.utime(drive.size() - 12); }));
  CHECK(stack.pid("geoslam_mapper") != killed);
  stack.stop();

  // The map's frame is the world, from the first pose on.
  std::map<model::Utime, geometry::SE2> truth;
  for (std::size_t k = 0; k < drive.size(); ++k) truth[drive.utime(k)] = drive.world_T_vehicle()[k];
  for (const model::SlamPose& pose : stack.poses) {
    CHECK(pose.map_id == 1);
    const Eigen::Vector2d at = pose.map_T_vehicle().translation();
    CHECK((at - truth.at(pose.utime).translation()).norm() < 0.25);
  }
  CHECK(stack.updates(model::MapUpdateStatus::kFirstMap) == 0);
  CHECK((read_bytes(file) == before));
}
