// `understory why` over logs of drives that were mapped.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "common/model/program_version.hpp"
#include "common/story/story_book.hpp"
#include "common/wire/convert.hpp"
#include "tests/catch.hpp"
#include "tests/cli/recorded_drive.hpp"
#include "tests/cli/run_command.hpp"
#include "tests/story/random_drive.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

/// A command in a directory of its own.
struct WhyFixture {
  test::TemporaryDirectory directory;
  std::string log = (directory / "mapped.lcm").string();

  test::Outcome run(const std::string& arguments) {
    return understory_command(directory, arguments);
  }
  void must_run(const std::string& arguments) {
    const auto outcome = run(arguments);
    CAPTURE(arguments, outcome.error);
    REQUIRE(outcome.status == 0);
  }
  nlohmann::json json(const std::string& arguments) {
    const auto outcome = run(arguments + " --json");
    CAPTURE(arguments, outcome.error);
    REQUIRE(outcome.status == 0);
    return nlohmann::json::parse(outcome.out);
  }
};

/// A short simulated drive through keyframer, mapper and existence tracker.
struct SimulatedWhy : WhyFixture {
  SimulatedWhy() {
    const std::string drive = (directory / "drive.lcm").string();
    must_run("sim intermediate --length 40 --seed 5 --out " + drive);
    must_run("replay " + drive +
             " --config " UNDERSTORY_SOURCE_CONFIG
             "/lidar --stages keyframer,geoslam_mapper,existence_tracker --out " +
             log);
  }
  std::vector<io::LogEvent> events() const {
    io::LcmLogReader reader(log);
    return read_log(reader);
  }
};

NaiveReader read_naively(const std::vector<io::LogEvent>& events) {
  NaiveReader naive;
  for (const auto& event : events) {
    if (event.channel == "SLAM_UPDATE")
      naive.take(wire::decode_message<model::MapUpdate>(event.data).value());
    if (event.channel == "MAP_DELTA")
      naive.take(wire::decode_message<model::MapDelta>(event.data).value());
    if (event.channel == "EXISTENCE")
      naive.take(wire::decode_message<model::Existence>(event.data).value());
  }
  return naive;
}

std::string fact(const nlohmann::json& story, const std::string& name) {
  for (const auto& one : story.at("facts"))
    if (one.at(0) == name) return one.at(1);
  return {};
}

/// Only what services/viewer/protocol.md lists, in its form, and the version of the program.
void check_form(const nlohmann::json& story) {
  CHECK(story.at("version") == model::program_version());
  const std::set<std::string> parts{"version", "title",     "facts", "events",
                                    "series",  "seen_from", "steps"};
  for (const auto& [name, value] : story.items()) CHECK(parts.contains(name));
  CHECK(story.at("title").is_string());
  for (const auto& one : story.value("events", nlohmann::json::array())) {
    CHECK(one.at(0).is_number_integer());
    CHECK(one.at(1).is_string());
  }
  for (const auto& one : story.value("series", nlohmann::json::array()))
    CHECK(one.at("t").size() == one.at("v").size());
  for (const auto& one : story.value("steps", nlohmann::json::array())) {
    CHECK(one.at("name").is_string());
    CHECK(one.at("text").is_string());
  }
}

}  // namespace

TEST_CASE_METHOD(SimulatedWhy, "of a mapped drive every landmark's numbers are those in the log",
                 "[cli]") {
  const auto all = events();
  story::StoryBook book(story::Limits::of_a_log());
  for (const auto& event : all) book.take(event.channel, event.data, event.utime);
  const NaiveReader naive = read_naively(all);
  REQUIRE(naive.notes().size() > 30);
  CHECK(book.malformed() == 0);

  for (const auto& [id, noted] : naive.notes()) {
    CAPTURE(id);
    const auto* record = book.landmarks().find(id);
    REQUIRE(record != nullptr);
    CHECK(record->seen == noted.seen.size());
    CHECK(record->missed == noted.missed.size());
    CHECK(record->probabilities.size() == noted.probabilities.size());
    for (std::uint32_t i = 0; i < record->probabilities.size(); ++i) {
      const auto& point = record->probabilities[i];
      CHECK(book.landmarks().moment(point.moment)->utime == noted.probabilities[i].first);
      CHECK(point.probability == Approx(noted.probabilities[i].second).margin(1e-6));
    }
    const auto [gaps, longest] = naive.gaps_and_longest(noted);
    CHECK(record->gaps == gaps);
    CHECK(record->longest_gap == longest);
    if (!noted.born.empty()) {
      CHECK(record->origin == story::Origin::kByKeyframe);
      CHECK(book.landmarks().moment(record->birth)->keyframe == noted.born.front());
    }
    if (!noted.told.empty()) CHECK((record->first_m - noted.told.front()).norm() < 1e-12);
  }
}

TEST_CASE_METHOD(SimulatedWhy, "why landmark tells its story as a page and as JSON", "[cli]") {
  const NaiveReader naive = read_naively(events());
  const auto& [id, noted] = *std::ranges::max_element(
      naive.notes(), {}, [](const auto& one) { return one.second.probabilities.size(); });
  const std::string name = "1:" + std::to_string(id & 0xFFFFFFFF);

  const auto page = run("why landmark " + name + " " + log);
  CAPTURE(page.error, page.out);
  CHECK(page.status == 0);
  CHECK_THAT(page.out, Contains("landmark " + name + " (" + std::to_string(id) + ")") &&
                           Contains("by " + std::to_string(noted.seen.size()) + " keyframe") &&
                           Contains("utime") && Contains("born"));

  const auto story = json("why landmark " + std::to_string(id) + " " + log);
  check_form(story);
  CHECK_THAT(fact(story, "seen"), Contains("by " + std::to_string(noted.seen.size())));
  CHECK(story.at("seen_from").size() == noted.seen.size());
  CHECK(story.at("series").at(0).at("t").size() == noted.probabilities.size());
}

TEST_CASE_METHOD(SimulatedWhy, "why pose finds poses by time and by what they are", "[cli]") {
  std::vector<model::SlamPose> poses;
  for (const auto& event : events())
    if (event.channel == "SLAM_POSE")
      poses.push_back(wire::decode_message<model::SlamPose>(event.data).value());
  REQUIRE(poses.size() > 20);

  const auto stamp = std::to_string(poses[10].utime);
  const auto story = json("why pose " + stamp + " " + log);
  check_form(story);
  CHECK_THAT(fact(story, "time"), Contains("utime " + stamp));
  CHECK(fact(story, "asked for").empty());
  CHECK_THAT(fact(story, "sensor to pose"), Contains("not known"));
  for (const auto& step : story.at("steps")) CHECK_FALSE(step.contains("ms"));

  const auto last = "utime " + std::to_string(poses.back().utime);
  CHECK_THAT(fact(json("why pose last " + log), "time"), Contains(last));
  CHECK_THAT(fact(json("why pose 9999999.5 " + log), "time"), Contains(last));
  // From the log's first stamp on: the first scans have no pose.
  const auto first = wire::header_of(events().front().data);
  const double seconds = 1e-6 * static_cast<double>(poses[10].utime - first->utime);
  CHECK_THAT(fact(json(fmt::format("why pose {:.3f} {}", seconds, log)), "time"),
             Contains("utime " + stamp));
  const auto worst = run("why pose worst " + log);
  CHECK(worst.status == 0);
  CHECK_THAT(worst.out, Contains("SLAM_UPDATE") && Contains("from the sensor on"));

  const auto slowest = run("why pose slowest " + log);
  CHECK(slowest.status == 1);
  CHECK_THAT(slowest.error, Contains("mapped.lcm") && Contains("times are not known"));
}

TEST_CASE_METHOD(SimulatedWhy, "why says what is wrong in one line", "[cli]") {
  const auto unknown = run("why landmark 1:999999 " + log);
  CHECK(unknown.status == 1);
  CHECK(lines(unknown.error) == 1);
  CHECK_THAT(unknown.error,
             Contains("no message names it") && Contains("map 1: ") && Contains("nearest 1:"));

  for (const std::string subject :
       {"landmark x", "landmark 1:", "landmark 1:2:3", "landmark 70000:1", "landmark 1.5",
        "pose soon", "pose nan", "pose 1e300"}) {
    const auto outcome = run("why " + subject + " " + log);
    CAPTURE(subject, outcome.error);
    CHECK(outcome.status == 2);
    CHECK(lines(outcome.error) == 1);
  }
  CHECK(run("why").status == 2);
  CHECK(run("why landmark 1:1").status == 2);
  const auto none = run("why pose last " + (directory / "none.lcm").string());
  CHECK(none.status == 1);
  CHECK_THAT(none.error, Contains("none.lcm"));

  // A log without a mapper, and a file that is no log.
  const auto raw = run("why pose last " + (directory / "drive.lcm").string());
  CHECK(raw.status == 1);
  CHECK_THAT(raw.error, Contains("no SLAM_POSE"));
  const auto other = (directory / "other.lcm").string();
  write_bytes(other, test::Bytes(1000, 'x'));
  CHECK_THAT(run("why landmark 1:1 " + other).error, Contains("no LCM log"));
}

TEST_CASE_METHOD(SimulatedWhy, "of a damaged log why tells the rest, and that there was more",
                 "[cli]") {
  auto bytes = test::read_bytes(log);
  const auto starts = test::offsets(events());
  for (std::size_t i = starts.size() / 2; i < starts.size() / 2 + 5; ++i) bytes[starts[i]] ^= 0xFFU;
  const auto damaged = (directory / "damaged.lcm").string();
  write_bytes(damaged, bytes);
  const auto landmark = run("why landmark 1:1 " + damaged);
  CHECK(landmark.status == 0);
  CHECK_THAT(landmark.out, Contains("the log is damaged") && Contains("may be missing"));
  CHECK(run("why pose last " + damaged).status == 0);
}

TEST_CASE_METHOD(WhyFixture, "why pose goes back to the raw scan of a recorded drive", "[cli]") {
  const RecordedDrive recorded;
  const std::string drive = (directory / "drive.lcm").string();
  must_run("import victoria-park " + recorded.path() + " --raw --out " + drive);
  must_run("replay " + drive + " --config " UNDERSTORY_SOURCE_CONFIG "/victoria_park --out " + log);
  const auto story = json("why pose last " + log);
  check_form(story);
  std::vector<std::string> names;
  for (const auto& step : story.at("steps")) names.push_back(step.at("name"));
  CHECK(names == std::vector<std::string>{"RAW_SCAN", "LIDAR_SCAN", "LANDMARKS", "ODOMETRY",
                                          "TRACKED_LANDMARKS", "EKF_POSE", "KEYFRAME",
                                          "SLAM_UPDATE", "SLAM_POSE"});
  CHECK_THAT(story.at("steps").at(0).at("text").get<std::string>(), Contains("return"));
}
