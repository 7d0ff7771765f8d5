// The JSON of a launch.
#include "deploy/cli/launch_report.hpp"

#include <nlohmann/json.hpp>

#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"

using namespace understory;

TEST_CASE("A launch report keeps the first ten thousand events", "[cli]") {
  const test::TemporaryDirectory directory;
  for (const std::size_t count : {0, 3, 9'999, 10'000, 10'001, 10'500}) {
    cli::LaunchReport report(true);
    for (std::size_t i = 0; i < count; ++i) report.add("mapper", "event " + std::to_string(i));
    report.write(directory / "report.json", {});
    const auto json = nlohmann::json::parse(test::read_text(directory / "report.json"));
    const auto& events = json["events"];
    REQUIRE(events.size() == std::min<std::size_t>(count, 10'000));
    for (std::size_t i = 0; i < events.size(); i += 999) {
      CHECK(events[i]["process"] == "mapper");
      CHECK(events[i]["text"] == "event " + std::to_string(i));
    }
  }
}
