// `understory map close`: a loop closed in a file that a drive left, and taken back.
#include <nlohmann/json.hpp>
#include <numbers>

#include "tests/catch.hpp"
#include "tests/cli/command_folder.hpp"
#include "tests/cli/driven_file.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

constexpr double kToDegrees = 180.0 / std::numbers::pi;

/// Its end does not see its beginning: only who knows the pose can close it.
RingOptions nearly_round(std::uint64_t seed) {
  RingOptions options;
  options.seed = seed;
  options.radius_m = 150.0;
  options.laps = 0.94;
  options.blind_from = 0.3;
  options.blind_to = 0.4;
  return options;
}

/// It comes round again, off by far more than odometry states: the mapper maps it twice.
RingOptions twice_mapped(std::uint64_t seed) {
  RingOptions options = nearly_round(seed);
  options.laps = 1.15;
  options.yaw_bias_rad = 3e-3;
  return options;
}

struct Closing : CommandFolder {
  RingDrive drive;
  std::filesystem::path file;
  std::vector<model::Submap> submaps;

  explicit Closing(const RingOptions& options)
      : drive(options), file(driven_file(drive, directory.path())) {
    submaps = MapFile(file, Access::kRead).submaps(1);
    std::erase_if(submaps, [](const model::Submap& one) { return one.keyframes.empty(); });
    REQUIRE(submaps.size() > 10);
  }

  /// Two submaps, the first ones of the drive and the last ones that were handed over.
  std::string ends(std::size_t from, std::size_t from_last) const {
    return fmt::format("map close {} --from submap:{} --to submap:{}", file.string(),
                       submaps[from].id, submaps[submaps.size() - 1 - from_last].id);
  }
  /// Between keyframes, with what a person knows of them.
  std::string known(std::size_t from, std::size_t to) const {
    const geometry::SE2 pose = drive.truth(from).inverse() * drive.truth(to);
    return fmt::format(
        "map close {} --from keyframe:{} --to keyframe:{} --x-m {:.4f} --y-m {:.4f} --theta-deg "
        "{:.4f} --sigma-m 0.05 --sigma-deg 0.2",
        file.string(), from, to, pose.x(), pose.y(), pose.theta() * kToDegrees);
  }
};

}  // namespace

TEST_CASE("a loop closed by a pose that is known ends near the truth, and can be taken back",
          "[cli]") {
  for (const std::uint64_t seed : {41, 42, 43}) {
    CAPTURE(seed);
    const Closing closing(nearly_round(seed));
    const std::string before = dump_placed(closing.file);
    const double before_m = mean_error_m(closing.drive, closing.file);
    const std::uint64_t from = middle_of(closing.submaps[1]);
    const std::uint64_t to = middle_of(closing.submaps.back());

    CHECK_THAT(closing.fine(closing.known(from, to) + " --dry-run"),
               Contains("nothing was written"));
    CHECK((dump_placed(closing.file) == before));
    const auto report = nlohmann::json::parse(closing.fine(closing.known(from, to) + " --json"));
    const double after_m = mean_error_m(closing.drive, closing.file);
    WARN(fmt::format(
        "mean error {:.2f} m before, {:.2f} after; chi2 {:.1f} before; {} motions, {} "
        "shared landmarks, {} assumed",
        before_m, after_m, report["chi2_before"].get<double>(), report["motions"].get<int>(),
        report["shared_landmarks"].get<int>(), report["assumed_motions"].get<int>()));
    CHECK(after_m < std::max(0.5 * before_m, 0.3));
    CHECK(report["chi2_before"] < 30.7);
    CHECK(report["chi2_after"] < report["chi2_before"]);
    CHECK(report["change"] == 2);
    CHECK(closing.fine("map check " + closing.file.string()) ==
          closing.file.string() + ": 1 maps, 2 changes, nothing wrong\n");

    // Where the store would read it, too.
    const MapFile opened(closing.file, Access::kRead);
    CHECK(opened.maps()[0].loop_closures == 1);
    REQUIRE(opened.closures(1).size() == 1);
    CHECK(opened.closures(1)[0].from.keyframe == from);
    const StoredMap map = opened.read(1);
    for (const model::Submap& one : opened.submaps(1)) {
      if (one.keyframes.empty()) continue;
      const auto shown = std::ranges::find(map.keyframes, one.keyframes[0].keyframe_sequence,
                                           &model::KeyframePose::keyframe_sequence);
      if (shown == map.keyframes.end()) continue;
      const geometry::SE2 stored = one.map_T_submap * one.keyframes[0].map_T_vehicle;
      CHECK((stored.translation() - shown->map_T_vehicle.translation()).norm() < 0.05);
    }
  }
}

TEST_CASE("a closure is a change of the history, and revert takes back every byte of it", "[cli]") {
  const Closing closing(nearly_round(44));
  const std::string before = dump_placed(closing.file);
  const std::string command =
      closing.known(middle_of(closing.submaps[0]), middle_of(closing.submaps.back()));
  closing.fine(command);
  const std::string after = dump_placed(closing.file);
  CHECK((after != before));
  CHECK_THAT(closing.fine("map log " + closing.file.string()),
             Contains("understory map close") && Contains("moved by up to"));

  closing.fine("map revert --to 1 " + closing.file.string());
  CHECK((dump_placed(closing.file) == before));
  closing.fine("map check " + closing.file.string());
  closing.fine("map revert --to 2 " + closing.file.string());
  CHECK((dump_placed(closing.file) == after));
  closing.fine("map revert --to 1 " + closing.file.string());
  closing.fine(command);
  CHECK((dump_placed(closing.file) == after));

  closing.refused(command, 1, "are closed already");

  // Another one on top; both go.
  closing.fine(closing.known(middle_of(closing.submaps[2]),
                             middle_of(closing.submaps[closing.submaps.size() - 3])));
  CHECK(MapFile(closing.file, Access::kRead).closures(1).size() == 2);
  closing.fine("map revert --to 1 " + closing.file.string());
  CHECK((dump_placed(closing.file) == before));
}

TEST_CASE("a place that a drive mapped twice is found by its landmarks", "[cli]") {
  const Closing closing(twice_mapped(51));
  const double before_m = mean_error_m(closing.drive, closing.file);
  REQUIRE(before_m > 1.0);
  // The newest that was handed over, and where the vehicle had been a lap before.
  const auto last = std::ranges::max_element(closing.submaps, {}, middle_of);
  const geometry::SE2& there = closing.drive.truth(middle_of(*last));
  const auto first = std::ranges::min_element(closing.submaps, {}, [&](const auto& one) {
    const bool is_late = middle_of(one) > middle_of(*last) / 2;
    const geometry::SE2& here = closing.drive.truth(middle_of(one));
    return (here.translation() - there.translation()).norm() + (is_late ? 1e3 : 0.0);
  });
  const std::string command =
      fmt::format("map close {} --from keyframe:{} --to keyframe:{}", closing.file.string(),
                  middle_of(*first), middle_of(*last));
  CAPTURE(middle_of(*first), middle_of(*last));
  // What nobody stated is beyond chance.
  closing.refused(command, 1, "contradicts the map beyond chance");
  const auto report = nlohmann::json::parse(closing.fine(command + " --force --json"));
  const double after_m = mean_error_m(closing.drive, closing.file);
  WARN(fmt::format(
      "mean error {:.2f} m before, {:.2f} after; {} pairs, chance 10^{:.0f}, chi2 {:.0f}; "
      "{} coincide, {} before",
      before_m, after_m, report["found"]["pairs"].get<int>(),
      report["found"]["log10_false_alarm"].get<double>(), report["chi2_before"].get<double>(),
      report["doubles"].get<int>(), report["doubles_before"].get<int>()));
  const geometry::SE2 found(report["pose"]["x_m"], report["pose"]["y_m"],
                            report["pose"]["theta_deg"].get<double>() / kToDegrees);
  const geometry::SE2 truth = closing.drive.truth(middle_of(*first)).inverse() * there;
  CHECK((found.inverse() * truth).Log().norm() < 0.3);
  CHECK(after_m < 0.5 * before_m);
  CHECK(report["doubles"] > report["doubles_before"]);
  CHECK(report["found"]["log10_false_alarm"] < -9.0);
  // Places that have nothing in common: the two furthest from each other.
  const auto far = std::ranges::max_element(closing.submaps, {}, [&](const auto& one) {
    const geometry::SE2& here = closing.drive.truth(middle_of(one));
    return (here.translation() - there.translation()).norm();
  });
  closing.refused(fmt::format("map close {} --from keyframe:{} --to keyframe:{}",
                              closing.file.string(), middle_of(*far), middle_of(*last)),
                  1, "not closed: ");
}

TEST_CASE("killed half way, the file is what it was or what it should be", "[cli]") {
  const Closing closing(nearly_round(45));
  const std::string command =
      closing.known(middle_of(closing.submaps[0]), middle_of(closing.submaps.back()));
  const std::string before = dump_placed(closing.file);
  closing.fine(command);
  const std::string after = dump_placed(closing.file);
  closing.fine("map revert --to 1 " + closing.file.string());

  std::mt19937_64 random(45);
  int done = 0;
  for (int i = 0; i < 25; ++i) {
    const double seconds = 0.004 * static_cast<double>(1 + random() % 40);
    const std::string line = fmt::format("timeout -s KILL {} {} {} > /dev/null 2>&1", seconds,
                                         UNDERSTORY_COMMAND, command);
    (void)std::system(line.c_str());  // NOLINT(cert-env33-c)
    closing.fine("map check " + closing.file.string());
    const std::string found = dump_placed(closing.file);
    const bool is_done = found == after;
    CHECK((is_done || found == before));
    if (!is_done) continue;
    ++done;
    closing.fine("map revert --to 1 " + closing.file.string());
    REQUIRE((dump_placed(closing.file) == before));
  }
  WARN(fmt::format("25 kills, {} of them after it was done", done));
}

TEST_CASE("what cannot be closed in a file is refused, and nothing is written", "[cli]") {
  const Closing closing(nearly_round(46));
  const std::string before = dump_placed(closing.file);
  const std::string file = closing.file.string();
  const std::string from =
      fmt::format("map close {} --from submap:{} ", file, closing.submaps[0].id);
  const std::string pose = " --x-m 1 --y-m 0 --theta-deg 0";
  closing.refused(from + "--to submap:9999", 1, "--to submap:9999: map 1 has no submap 9999");
  closing.refused(from + "--to keyframe:99999", 1, "has no keyframe 99999");
  closing.refused(from + "--to 5", 2, "keyframe:N or submap:N (from 1) is wanted");
  closing.refused(from + "--to submap:0", 2, "submap:N (from 1) is wanted");
  closing.refused(closing.ends(0, closing.submaps.size() - 1) + pose, 1,
                  "both ends are in one part");
  closing.refused(closing.ends(0, closing.submaps.size() - 2), 1, "neighbours on the path");
  closing.refused(closing.ends(0, 0) + " --map 7", 1, "has no map 7");
  for (const char* const wrong :
       {"--x-m nan --y-m 0 --theta-deg 0", "--x-m 1 --y-m inf --theta-deg 0", "--x-m 1",
        "--x-m 1 --y-m 0 --theta-deg 0 --sigma-m 0",
        "--x-m 1 --y-m 0 --theta-deg 0 --sigma-deg nan"})
    CHECK(closing.run(closing.ends(0, 0) + " " + wrong).status != 0);
  closing.refused(closing.ends(0, 0) + " --x-m 300 --y-m 300 --theta-deg 90", 1,
                  "contradicts the map beyond chance");

  const auto other = [&](const std::string& name) {
    return "map close " + (closing.directory / name).string() + " --from submap:1 --to submap:9";
  };
  closing.refused(other("none.gpkg"), 1, "there is no such file");
  write_bytes(closing.directory / "text.gpkg", Bytes(200, 'x'));
  closing.refused(other("text.gpkg"), 1, "text.gpkg: no map file");
  const std::string table = "x_m,y_m\n1,2\n3,4\n";
  write_bytes(closing.directory / "stems.csv", Bytes(table.begin(), table.end()));
  closing.fine("map import " + (closing.directory / "stems.csv").string() + " --out " +
               (closing.directory / "survey.gpkg").string());
  closing.refused(other("survey.gpkg"), 1, "only a drive's file has them");

  {
    const MapFile in_use(file, Access::kWrite);
    closing.refused(closing.ends(0, 0) + pose, 1, "drive-0001.gpkg");
  }
  CHECK((dump_placed(closing.file) == before));
}
