#include "common/io/lcm_log.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

test::Bytes derived_log(const test::TemporaryDirectory& directory, const std::string& name) {
  const auto outcome = understory_command(
      directory, "replay " + (directory / "drive.lcm").string() + " --config " +
                     directory.path().string() + " --out " + (directory / name).string());
  CAPTURE(outcome.error);
  REQUIRE(outcome.status == 0);
  return test::read_bytes(directory / name);
}

}  // namespace

TEST_CASE("replay of one log gives the same bytes every time", "[system]") {
  test::TemporaryDirectory directory;
  REQUIRE(understory_command(directory, "sim intermediate --length 30 --seed 5 --out " +
                                            (directory / "drive.lcm").string())
              .status == 0);
  const auto first = derived_log(directory, "first.lcm");
  CHECK(first.size() > read_bytes(directory / "drive.lcm").size());
  CHECK(derived_log(directory, "second.lcm") == first);

  const auto accuracy =
      understory_command(directory, "log accuracy " + (directory / "first.lcm").string());
  CHECK(accuracy.status == 0);
  CHECK_THAT(accuracy.out, Contains("map updates"));
}

TEST_CASE("replay gives the same with the viewer and without it", "[system]") {
  test::TemporaryDirectory directory;
  REQUIRE(understory_command(directory, "sim intermediate --length 20 --seed 6 --out " +
                                            (directory / "drive.lcm").string())
              .status == 0);
  const auto replayed = [&](const std::string& stages) {
    const std::string out = directory / (stages + ".lcm");
    const auto outcome = understory_command(
        directory, "replay " + (directory / "drive.lcm").string() + " --out " + out +
                       " --outputs-only --stages keyframer,geoslam_mapper" + stages);
    REQUIRE(outcome.status == 0);
    // The viewer says which configuration it has; nothing else.
    std::vector<std::pair<std::string, std::vector<std::uint8_t>>> events;
    io::LcmLogReader reader(out);
    while (auto event = reader.next()) {
      if (event->channel != "CONFIG" && event->channel != "HEALTH")
        events.emplace_back(event->channel, std::move(event->data));
    }
    return events;
  };
  const auto without = replayed("");
  CHECK(without.size() > 100);
  CHECK(replayed(",viewer") == without);
}

TEST_CASE("replay refuses unknown stages and files", "[system]") {
  test::TemporaryDirectory directory;
  const auto none = understory_command(directory, "replay none.lcm --out o.lcm");
  CHECK(none.status == 1);
  CHECK_THAT(none.error, Contains("none.lcm"));
  const auto stage = understory_command(directory, "replay none.lcm --out o.lcm --stages cook");
  CHECK(stage.status == 2);
  CHECK_THAT(stage.error, Contains("cook"));
}
