#include <cmath>
#include <limits>

#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"
#include "tests/system/stack.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

/// Messages that nobody may take: noise, cut ones, counts of two billion and of minus one.
std::vector<wire::Bytes> hostile_messages(const wire::Bytes& good, std::mt19937_64& random) {
  std::uniform_int_distribution<int> byte(0, 255);
  std::vector<wire::Bytes> messages{{}, {0}, wire::Bytes(8, 0xFF)};
  for (int i = 0; i < 50; ++i) {
    wire::Bytes noise(1 + static_cast<std::size_t>(i) * 13);
    for (auto& value : noise) value = static_cast<std::uint8_t>(byte(random));
    messages.push_back(noise);
    messages.emplace_back(
        good.begin(),
        good.begin() + static_cast<std::ptrdiff_t>(good.size() * static_cast<std::size_t>(i) / 50));
  }

  // Every place where a count may be.
  for (std::size_t at = 8; at + 4 <= std::min<std::size_t>(good.size(), 200); at += 4) {
    for (const std::uint8_t value : {0x7F, 0xFF}) {
      wire::Bytes message = good;
      std::fill_n(message.begin() + static_cast<std::ptrdiff_t>(at), 4, value);
      message.pop_back();  // Whatever the four bytes meant, it is not whole.
      messages.push_back(std::move(message));
    }
  }

  return messages;
}

}  // namespace

TEST_CASE("hostile bytes and numbers are counted and stop nobody", "[system]") {
  std::mt19937_64 random(99);
  const auto drive = test::short_drive(13);
  test::Stack stack;
  REQUIRE(stack.wait_for_processes());
  const std::size_t half = drive.size() / 2;
  stack.drive(drive, 0, half);
  REQUIRE(stack.wait_until([&] { return stack.newest_pose() >= drive.utime(half - 12); }));
  const pid_t keyframer = stack.pid("keyframer");
  const pid_t mapper = stack.pid("geoslam_mapper");

  auto scan = drive.scan(half).scan;
  const auto bad = hostile_messages(wire::encode_message(scan), random);
  for (const auto& message : bad) {
    for (const char* channel :
         {"LANDMARKS", "KEYFRAME", "VIEW_RANGES", "ODOMETRY", "MAP_REQUEST"}) {
      stack.publish(channel, message);
    }
    stack.wait_until([n = 0]() mutable { return n++ > 0; });  // One message's time to breathe.
  }
  for (const double value :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
    auto poisoned = scan;
    poisoned.detections.at(0).position_m.x() = value;
    stack.publish("LANDMARKS", wire::encode_message(poisoned));
    poisoned = scan;
    poisoned.detections.at(0).covariance_m2(0, 0) = value;
    stack.publish("LANDMARKS", wire::encode_message(poisoned));
  }
  const std::size_t poses_before = stack.poses.size();
  stack.drive(drive, half, drive.size());
  CHECK(stack.wait_until([&] { return stack.newest_pose() >= drive.utime(drive.size() - 12); }));

  // Some may be lost when the processors are busy; most must have been counted.
  const auto sent = static_cast<std::int64_t>(bad.size());
  CHECK(
      stack.wait_until([&] { return stack.malformed("keyframer", "LANDMARKS") >= sent * 3 / 4; }));
  CHECK(stack.wait_until(
      [&] { return stack.malformed("geoslam_mapper", "KEYFRAME") >= sent * 3 / 4; }));
  CHECK(stack.wait_until(
      [&] { return stack.malformed("geoslam_mapper", "VIEW_RANGES") >= sent * 3 / 4; }));
  CHECK(stack.pid("keyframer") == keyframer);
  CHECK(stack.pid("geoslam_mapper") == mapper);
  CHECK(stack.poses.size() > poses_before);
  CHECK(largest_error_m(stack, drive) < 0.25);
  CHECK(stack.refused == 0);  // Nothing non-finite was published.
}

TEST_CASE("a wrong configuration is refused with file and key", "[system]") {
  test::TemporaryDirectory directory;
  write_config(directory, "colour = 1\n");
  const auto outcome = understory_command(
      directory, "launch --config " + directory.path().string() + " --state-dir " +
                     (directory / "state").string() + " --lcm-url '" + test::private_url() + "'");
  CAPTURE(outcome.out, outcome.error);
  CHECK(outcome.status == 2);
  CHECK_THAT(outcome.error, Contains("keyframer.toml") && Contains("colour"));
}
