// `log accuracy` of logs in which something is missing.
#include <fmt/format.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "common/model/map.hpp"
#include "common/wire/convert.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

/// A short simulated drive, mapped.
struct MappedDrive {
  test::TemporaryDirectory directory;
  std::string log = (directory / "mapped.lcm").string();
  std::string cut = (directory / "cut.lcm").string();

  MappedDrive() {
    const std::string drive = (directory / "drive.lcm").string();
    REQUIRE(run("sim intermediate --length 30 --seed 5 --out " + drive).status == 0);
    REQUIRE(run("replay " + drive + " --config " UNDERSTORY_SOURCE_CONFIG " --out " + log).status ==
            0);
  }
  test::Outcome run(const std::string& arguments) {
    return understory_command(directory, arguments);
  }

  /// The accuracy of the log without the events that `is_lost` names.
  nlohmann::json accuracy_without(const std::function<bool(const io::LogEvent&)>& is_lost) {
    io::LcmLogReader reader(log);
    io::LcmLogWriter writer(cut);
    while (const auto event = reader.next()) {
      if (!is_lost(*event)) writer.write(*event);
    }
    writer.commit();
    const auto outcome = run("log accuracy " + cut + " --json " + (directory / "a.json").string());
    CAPTURE(outcome.error);
    REQUIRE(outcome.status == 0);
    CHECK_THAT(outcome.out, Contains("the map is tied to the world at"));
    return nlohmann::json::parse(read_text(directory / "a.json"));
  }
};

bool starts_the_map(const io::LogEvent& event) {
  if (event.channel != "SLAM_UPDATE") return false;
  const auto update = wire::decode_message<model::MapUpdate>(event.data);
  return update && update->status == model::MapUpdateStatus::kFirstMap;
}

}  // namespace

TEST_CASE_METHOD(MappedDrive, "a log without the map's first update has an accuracy", "[cli]") {
  const auto whole = accuracy_without([](const io::LogEvent&) { return false; });
  CHECK(whole["map_tied_at"] == "the update that started it");
  CHECK(whole["rpe_cm"].get<double>() < 20.0);

  const auto without_start = accuracy_without(starts_the_map);
  CHECK_THAT(without_start["map_tied_at"].get<std::string>(), Contains("oldest keyframe"));
  CHECK(without_start["rpe_cm"].get<double>() == Approx(whole["rpe_cm"].get<double>()).margin(0.1));

  const auto without_maps = accuracy_without(
      [](const io::LogEvent& event) { return starts_the_map(event) || event.channel == "MAP"; });
  CHECK_THAT(without_maps["map_tied_at"].get<std::string>(), Contains("first update in the log"));
  CHECK(without_maps["live_mean_cm"].get<double>() < 50.0);
}

TEST_CASE_METHOD(MappedDrive, "log accuracy never writes over its log", "[cli]") {
  const auto before = test::read_bytes(log);
  std::filesystem::create_symlink("mapped.lcm", directory / "link");
  for (const std::string& name : {log, (directory / "link").string()}) {
    const auto outcome = run("log accuracy " + log + " --json " + name);
    CHECK(outcome.status == 2);
    CHECK_THAT(outcome.error, Contains("is the log itself"));
  }
  CHECK(test::read_bytes(log) == before);

  // Standard output that is a file keeps what was printed before.
  const auto printed = run("log accuracy " + log + " --json /dev/stdout");
  CHECK(printed.status == 0);
  CHECK_THAT(printed.out, Contains("map updates") && Contains("\"pose_columns\""));
}
