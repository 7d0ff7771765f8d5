// Log in, log out: the same bytes every time, nothing lost, nothing fed twice.
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/bus/replay.hpp"
#include "common/io/lcm_log.hpp"
#include "tests/bus/toy_service.hpp"
#include "tests/catch.hpp"
#include "understory/config_t.hpp"

using namespace understory;
using namespace understory::bus;
using namespace understory::test;
namespace fs = std::filesystem;

namespace {

fs::path scratch(const std::string& name) {
  return fs::temp_directory_path() /
         ("understory-replay-" + std::to_string(::getpid()) + "-" + name);
}

std::string read(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void write_inputs(const fs::path& file, int count) {
  io::LcmLogWriter writer(file);
  for (int i = 0; i < count; ++i) {
    const model::Odometry input = test::toy_input(i);
    writer.write(input.utime + 3, "ODOMETRY", wire::encode_message(input));
    writer.write(input.utime + 4, "OTHER", std::vector<std::uint8_t>{1, 2, 3});
  }
  writer.commit();
}

std::vector<io::LogEvent> events_of(const fs::path& file, const std::string& channel) {
  std::vector<io::LogEvent> events;
  io::LcmLogReader reader(file);
  while (auto event = reader.next()) {
    if (event->channel == channel) events.push_back(*event);
  }
  return events;
}

}  // namespace

TEST_CASE("the same log gives the same bytes; outputs of hosted stages are not fed back") {
  const fs::path in = scratch("in");
  const fs::path out = scratch("out");
  const fs::path again = scratch("again");
  const fs::path twice = scratch("twice");
  write_inputs(in, 100);
  ReplayOptions options;
  options.log = in;
  options.out = out;
  options.services = {test::toy_service()};
  const ReplayReport report = replay(options);
  CHECK(report.events == 200);
  CHECK(report.fed == 100);
  CHECK(report.left_out == 0);
  CHECK(report.derived == 101);  // and CONFIG
  options.out = again;
  replay(options);
  CHECK(read(out) == read(again));
  CHECK(read(out).size() > read(in).size());

  // The output replayed: its RAW_POSE and CONFIG are left out and made anew.
  options.log = out;
  options.out = twice;
  const ReplayReport second = replay(options);
  CHECK(second.left_out == 101);
  CHECK(read(twice) == read(out));

  const auto poses = events_of(out, "RAW_POSE");
  REQUIRE(poses.size() == 100);
  CHECK(poses[0].utime == test::toy_input(0).utime + 3);
  CHECK(wire::decode_message<raw_pose_t>(poses.back().data)->odom_T_vehicle.x == 5050.0);
  CHECK(events_of(out, "OTHER").size() == 100);
  CHECK(events_of(out, "HEALTH").empty());
  for (const fs::path& file : {in, out, again, twice}) fs::remove(file);
}

TEST_CASE("a replay that is stopped writes nothing") {
  const fs::path in = scratch("in2");
  const fs::path out = scratch("out2");
  write_inputs(in, 1000);
  ReplayOptions options;
  options.log = in;
  options.out = out;
  options.services = {test::toy_service()};
  options.progress = [](double) { return true; };
  CHECK(replay(options).was_stopped);
  CHECK_FALSE(fs::exists(out));
  fs::remove(in);
}

TEST_CASE("configuration comes from one file per service and lands in the log") {
  const fs::path in = scratch("in3");
  const fs::path out = scratch("out3");
  const fs::path config = scratch("config");
  write_inputs(in, 10);
  fs::create_directories(config);
  std::ofstream(config / "toy.toml") << "[toy]\ngain = 4\n";
  ReplayOptions options;

  options.log = in;
  options.out = out;
  options.services = {test::toy_service()};
  options.config_dir = config;
  options.channel_suffix = "_ALT";
  options.keeps_inputs = false;
  replay(options);

  const auto poses = events_of(out, "RAW_POSE_ALT");
  REQUIRE(poses.size() == 10);
  CHECK(wire::decode_message<raw_pose_t>(poses.back().data)->odom_T_vehicle.x == 4.0 * 55.0);
  const auto configs = events_of(out, "CONFIG");
  REQUIRE(configs.size() == 1);
  CHECK(wire::decode_message<config_t>(configs[0].data)->toml.find("gain = 4.0") !=
        std::string::npos);
  CHECK(events_of(out, "ODOMETRY").empty());

  std::ofstream(config / "toy.toml") << "[toy]\ngain = 400\n";
  CHECK_THROWS_AS(replay(options), ConfigurationError);
  fs::remove(in);
  fs::remove(out);
  fs::remove_all(config);
}
