#include <fmt/format.h>

#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"
#include "tests/system/stack.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

TEST_CASE("a person closes a loop in the running mapper, and takes it back", "[system][loop]") {
  const TemporaryDirectory directory;
  const auto drive = test::short_drive(14);
  test::Stack stack;
  REQUIRE(stack.wait_for_processes());
  stack.drive(drive, 0, drive.size());
  REQUIRE(stack.wait_until([&] { return stack.newest_pose() >= drive.utime(drive.size() - 12); }));
  std::vector<const model::MapUpdate*> placed;
  for (const model::MapUpdate& update : stack.all_updates)
    if (update.status == model::MapUpdateStatus::kUpdated) placed.push_back(&update);
  REQUIRE(placed.size() > 3);
  const model::MapUpdate& from = *placed.front();
  const model::MapUpdate& to = *placed.back();
  const geometry::SE2 between = from.map_T_vehicle.inverse() * to.map_T_vehicle;

  const std::string bus = " --lcm-url " + stack.url();
  const auto ends = [&](std::uint64_t first, std::uint64_t second) {
    return fmt::format(" --from keyframe:{} --to keyframe:{} --x={} --y={} --theta-deg={}", first,
                       second, between.x(), between.y(), between.theta() * 57.29577951);
  };
  const std::string right = ends(from.keyframe_sequence, to.keyframe_sequence);
  const Outcome closed = understory_command(directory, "loop close --id 7" + right + bus);
  CAPTURE(closed.error);
  CHECK(closed.status == 0);
  CHECK_THAT(closed.out, Contains("closure 7 of map 1: accepted"));

  const Outcome revoked = understory_command(directory, "loop revoke 7" + bus);
  CHECK(revoked.status == 0);
  CHECK_THAT(revoked.out, Contains("closure 7 of map 1: revoked"));
  const Outcome again = understory_command(directory, "loop revoke 7" + bus);
  CHECK(again.status == 1);
  CHECK_THAT(again.error, Contains("there is no such closure"));
  const Outcome absent = understory_command(directory, "loop close" + ends(0, 99999) + bus);
  CHECK(absent.status == 1);
  CHECK_THAT(absent.error, Contains("keyframe 99999 is not in the graph"));
}

TEST_CASE("loop close says what is wrong", "[system][loop]") {
  const TemporaryDirectory directory;
  const Outcome wrong = understory_command(directory, "loop close --from here --to keyframe:2");
  CHECK(wrong.status == 2);
  CHECK_THAT(wrong.error, Contains("--from here: keyframe:N or submap:N"));
  const Outcome nobody =
      understory_command(directory, "loop revoke 3 --timeout 0.3 --lcm-url " + test::private_url());
  CHECK(nobody.status == 1);
  CHECK_THAT(nobody.error, Contains("no mapper answered"));
}
