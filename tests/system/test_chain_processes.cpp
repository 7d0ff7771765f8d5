// The processes of the LIDAR chain: started, killed, hung and stopped, with lcm-logplayer as
// driver.
#include "common/map_file/map_file.hpp"
#include "tests/catch.hpp"
#include "tests/system/chain_stack.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

const std::vector<std::string> kVictims = {"lidar_imu_input", "landmark_extractor", "associator",
                                           "ekf"};

LargestErrors slam_errors(const ChainStack& stack, const RecordedSensors& drive) {
  return largest_errors(
      stack.slam, drive, [](const model::SlamPose& pose) { return pose.map_T_vehicle(); },
      [](const model::SlamPose& pose) { return pose.map_id; });
}

LargestErrors ekf_errors(const ChainStack& stack, const RecordedSensors& drive) {
  return largest_errors(
      stack.ekf, drive, [](const model::EkfPose& pose) { return pose.ekf_map_T_vehicle; },
      [](const model::EkfPose&) { return 0U; });
}

/// No pose is farther off than this. On a busy computer a process is away for seconds, and where
/// the input was nobody knows the motion: then the jump is announced, and the covariance says so.
template <class Pose>
void check_errors(const std::vector<Pose>& poses, const LargestErrors& errors, double limit_m) {
  CHECK(errors.any_m >= 0.0);
  CHECK(errors.unstated_m < limit_m);
  const bool is_announced = poses.front().reset_counter != poses.back().reset_counter;
  if (!is_announced) CHECK(errors.any_m < limit_m);
}

void check_errors(const ChainStack& stack, const RecordedSensors& drive, double limit_m) {
  check_errors(stack.slam, slam_errors(stack, drive), limit_m);
  check_errors(stack.ekf, ekf_errors(stack, drive), limit_m);
}

/// Whether every process has had all messages: none was lost on a busy computer.
bool heard_all(const ChainStack& stack) {
  return std::ranges::all_of(stack.health, [](const auto& entry) {
    return std::ranges::all_of(entry.second.channels, [](const channel_health_t& channel) {
      return channel.lost == 0 && channel.dropped == 0;
    });
  });
}

/// Whether both estimates go on past the stamp.
bool goes_on_past(ChainStack& stack, model::Utime utime) {
  return stack.wait_until([&] {
    return !stack.slam.empty() && stack.slam.back().utime > utime && !stack.ekf.empty() &&
           stack.ekf.back().utime > utime;
  });
}

/// Signals every victim in turn, each when the drive has gone on since the one before; each must
/// come back with another number.
void signal_in_turn(ChainStack& stack, int signal) {
  for (const std::string& victim : kVictims) {
    CAPTURE(victim, signal);
    const pid_t before = stack.pid(victim);
    const model::Utime then = stack.ekf.back().utime;
    ::kill(before, signal);
    CHECK(stack.wait_until([&] { return stack.pid(victim) != before; }));
    CHECK(goes_on_past(stack, then + 1'500'000));
  }
}

}  // namespace

TEST_CASE("lcm-logplayer drives the processes from raw sensors to the map", "[system][chain]") {
  const RecordedSensors drive(40.0, 31);
  ChainStack stack;
  REQUIRE(stack.wait_for_processes());
  stack.play(drive.log());
  REQUIRE(goes_on_past(stack, drive.last_sweep() - 1'000'000));

  CAPTURE(stack.slam.size(), stack.ekf.size());
  CHECK(stack.slam.size() > 80);
  check_errors(stack, drive, heard_all(stack) ? 0.05 : 0.3);
  for (const std::string& process : kChainProcesses) CHECK(stack.pids[process].size() == 1);

  const launch::Ending ending = stack.stop();
  CHECK(ending.known);
  CHECK(ending.exit_code == 0);
  CHECK(ending.signal == 0);
  CHECK_THAT(read_text(stack.report()),
             Contains("\"text\": \"ended\"") && !Contains("does not end"));

  // What the drive leaves is a map.
  const map_file::MapFile map(stack.map_file(), map_file::Access::kRead);
  CHECK(map.check().empty());
  REQUIRE(map.maps().size() == 1);
  CHECK(map.maps()[0].trunks > 20);
  CHECK(map.maps()[0].keyframes > 10);
}

TEST_CASE("a killed process of the chain comes back, and the pose with it", "[system][chain]") {
  const RecordedSensors drive(100.0, 32);
  ChainStack stack;
  REQUIRE(stack.wait_for_processes());
  stack.play(drive.log());
  REQUIRE(goes_on_past(stack, 7'000'000));

  signal_in_turn(stack, SIGKILL);
  REQUIRE(goes_on_past(stack, drive.last_sweep() - 1'000'000));

  check_errors(stack, drive, 0.3);
  for (const std::string& victim : kVictims) CHECK(stack.pids[victim].size() == 2);
  stack.stop();
  CHECK_THAT(read_text(stack.report()), Contains("killed by signal 9") && !Contains("given up"));
}

TEST_CASE("a chain that is stopped and started again goes on with its state", "[system][chain]") {
  const RecordedSensors drive(60.0, 34);
  ChainStack stack;
  REQUIRE(stack.wait_for_processes());
  stack.play(drive.log());
  REQUIRE(goes_on_past(stack, 9'000'000));

  const model::Utime stopped = stack.slam.back().utime;
  CHECK(stack.stop().exit_code == 0);
  CHECK_THAT(read_text(stack.report()), !Contains("does not end"));
  stack.start();
  REQUIRE(goes_on_past(stack, drive.last_sweep() - 1'000'000));
  CHECK(stack.slam.back().utime > stopped);
  for (const std::string& process : kChainProcesses) CHECK(stack.pids[process].size() == 2);
  // The map is the same one: the first pose's frame still holds.
  CHECK(slam_errors(stack, drive).any_m < 1.0);
}

TEST_CASE("a process of the chain that hangs is started again, and the pose comes back",
          "[system][chain]") {
  const RecordedSensors drive(100.0, 33);
  ChainStack stack;
  REQUIRE(stack.wait_for_processes());
  stack.play(drive.log());
  REQUIRE(goes_on_past(stack, 7'000'000));

  signal_in_turn(stack, SIGSTOP);
  REQUIRE(goes_on_past(stack, drive.last_sweep() - 1'000'000));
  for (const std::string& victim : kVictims) CHECK(stack.pids[victim].size() == 2);
  check_errors(stack, drive, 0.3);
  stack.stop();
  CHECK_THAT(read_text(stack.report()), !Contains("given up"));
}
