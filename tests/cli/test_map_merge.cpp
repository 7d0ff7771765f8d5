// `understory map merge`, and what it writes.
#include <nlohmann/json.hpp>

#include "common/io/lcm_log.hpp"
#include "common/wire/convert.hpp"
#include "sim/forest.hpp"
#include "tests/catch.hpp"
#include "tests/cli/command_folder.hpp"
#include "tests/map_file/map_fixture.hpp"
#include "understory/ground_truth_t.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

/// One forest, surveyed or driven through again and again; each time other trees are missed.
struct Forest : CommandFolder {
  std::mt19937_64 random{3};
  std::vector<Eigen::Vector2d> trees;
  std::string a = path("a.gpkg");
  std::string b = path("b.gpkg");

  Forest() {
    sim::ForestParameters parameters;
    parameters.side_m = 100.0;
    parameters.min_distance_m = 4.0;
    parameters.jitter_sigma_m = 1.0;
    trees = sim::make_forest(parameters, random).trunks_m;
  }

  std::string path(const std::string& name) const { return (directory / name).string(); }
  nlohmann::json json(const std::string& arguments) const {
    return nlohmann::json::parse(fine(arguments + " --json"));
  }

  /// A table of some of the trees with x in [low, high), as they lie in the frame.
  std::string table(const std::string& name, double low_m, double high_m, double share,
                    double sigma_m, const geometry::SE2& frame_T_world) {
    std::normal_distribution<double> normal(0.0, sigma_m);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    std::string text = "x_m,y_m\n";
    for (const Eigen::Vector2d& tree : trees) {
      if (tree.x() < low_m || tree.x() >= high_m || unit(random) >= share) continue;
      const double x = normal(random);
      const Eigen::Vector2d at = frame_T_world * tree + Eigen::Vector2d(x, normal(random));
      text += fmt::format("{:.4f},{:.4f}\n", at.x(), at.y());
    }
    write_bytes(directory / name, Bytes(text.begin(), text.end()));
    return path(name);
  }
  void survey(const std::string& file, double low_m, double high_m,
              const geometry::SE2& frame_T_world) {
    const std::string stems = table("stems.csv", low_m, high_m, 0.7, 0.05, frame_T_world);
    fine("map import " + stems + " --near-m 0 --sigma-m 0.05 --out " + file);
  }
  /// Two maps of neighbouring parts; the second frame is shifted by half a metre and turned.
  void two_surveys() {
    survey(a, 0.0, 70.0, {});
    survey(b, 30.0, 100.0, geometry::SE2(0.4, -0.3, 0.01).inverse());
  }
};

/// map_T_world of a drive's map, by the truth at its first keyframe.
geometry::SE2 map_T_world(const std::string& log, const std::string& map) {
  const auto keyframes = map_file::MapFile(map, Access::kRead).read(1).keyframes;
  io::LcmLogReader reader(log);
  while (const auto event = reader.next()) {
    if (event->channel != "GROUND_TRUTH") continue;
    const auto one = wire::decode_message<ground_truth_t>(event->data);
    if (one->utime == keyframes.front().utime)
      return keyframes.front().map_T_vehicle * wire::from_wire(one->world_T_vehicle).inverse();
  }
  FAIL("no truth at the first keyframe");
  return {};
}

/// Chi-squared of what was reported, three degrees of freedom.
double chi2_of(const nlohmann::json& report, const geometry::SE2& truth) {
  const auto& offset = report["offset"];
  const geometry::SE2 found(offset["x_m"], offset["y_m"], offset["heading_rad"]);
  Eigen::Matrix3d covariance;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) covariance(i, k) = report["covariance"][i][k];
  }
  const Eigen::Vector3d error = (found.inverse() * truth).Log();
  return error.dot(covariance.inverse() * error);
}

}  // namespace

TEST_CASE_METHOD(Forest, "merge reports the offset and writes nothing unless asked", "[cli]") {
  two_surveys();
  const Bytes before = read_bytes(a);
  const auto report = json("map merge " + a + " " + b);
  CHECK(report["offset"]["x_m"].get<double>() == Approx(0.4).margin(0.05));
  CHECK(report["offset"]["y_m"].get<double>() == Approx(-0.3).margin(0.05));
  CHECK(report["offset"]["heading_rad"].get<double>() == Approx(0.01).margin(0.001));
  CHECK(chi2_of(report, geometry::SE2(0.4, -0.3, 0.01)) < 16.3);  // 99.9 %
  CHECK(report["pairs"].get<int>() > 50);
  CHECK(report["doubled_pct"].get<double>() <= 1.0);
  CHECK(report["written"].is_null());
  CHECK((read_bytes(a) == before));
  CHECK_THAT(fine("map merge " + a + " " + b), Contains("nothing was written"));
}

TEST_CASE_METHOD(Forest, "a merge is a change, and revert takes it back to the byte", "[cli]") {
  two_surveys();
  const Bytes other = read_bytes(b);
  const std::string rows = dump(a);
  const auto before = nlohmann::json::parse(fine("map info --json " + a));
  CHECK_THAT(fine("map merge " + a + " " + b + " --into " + a), Contains("-> " + a));
  fine("map check " + a);
  CHECK((read_bytes(b) == other));
  CHECK((dump(a) != rows));
  const auto merged = nlohmann::json::parse(fine("map info --json " + a));
  REQUIRE(merged["maps"].size() == 2);
  CHECK(merged["maps"][0]["trunks"] > before["maps"][0]["trunks"]);
  CHECK(merged["maps"][1]["trunks"] == 0);
  CHECK(merged["maps"][1]["map_id"] == 2);
  const auto log = nlohmann::json::parse(fine("map log --json " + a));
  REQUIRE(log["changes"].size() == 2);
  CHECK(log["changes"][1]["command"] == "understory map merge");
  CHECK(log["changes"][1]["source"] == "b.gpkg map 1");
  CHECK_THAT(log["changes"][1]["text"].get<std::string>(),
             Contains("into map 1") && Contains("its frame lies at 0.") && Contains("sigma"));

  fine("map revert --to 1 " + a);
  fine("map check " + a);
  CHECK((dump(a) == rows));
  const auto after = nlohmann::json::parse(fine("map info --json " + a));
  CHECK(after["maps"] == before["maps"]);  // The checksums with them.
  // And forth again: reverting is a change, too.
  fine("map revert --to 2 " + a);
  CHECK(nlohmann::json::parse(fine("map info --json " + a))["maps"] == merged["maps"]);
}

TEST_CASE_METHOD(Forest, "--out leaves both files and keeps the first one's history", "[cli]") {
  two_surveys();
  const Bytes first = read_bytes(a);
  const Bytes second = read_bytes(b);
  const std::string c = path("c.gpkg");
  fine("map merge " + a + " " + b + " --out " + c);
  CHECK((read_bytes(a) == first));
  CHECK((read_bytes(b) == second));
  fine("map check " + c);
  CHECK(nlohmann::json::parse(fine("map log --json " + c))["changes"].size() == 2);
  fine("map revert --to 1 " + c);
  CHECK((dump(c) == dump(a)));
  refused("map merge " + a + " " + b + " --out " + c, 1, "c.gpkg");
  // The other way round, into the second one: its frame and ids stay.
  fine("map merge " + a + " " + b + " --into " + b);
  const auto into_b = map_file::MapFile(b, Access::kRead).read(1);
  const auto only_b = map_file::MapFile(path("c.gpkg"), Access::kRead).read(1);
  CHECK(into_b.origin == only_b.origin);
  CHECK((read_bytes(a) == first));
}

TEST_CASE_METHOD(Forest, "two maps of one file become one", "[cli]") {
  two_surveys();
  survey(a, 30.0, 100.0, geometry::SE2(5.0, 5.0, 1.0));
  refused("map merge " + a + " " + a, 1, "2 maps with landmarks are in it");
  refused("map merge " + a + " " + a + " --first-map 1 --second-map 1", 2, "both are one map");
  refused("map merge " + a + " " + b + " --first-map 9", 1, "a.gpkg: has no map 9");
  fine("map merge " + a + " " + a + " --first-map 1 --second-map 2 --into " + a);
  fine("map check " + a);
  const auto info = nlohmann::json::parse(fine("map info --json " + a));
  CHECK(info["maps"].size() == 2);
  CHECK(info["maps"][1]["trunks"] == 0);
  // Now only one has landmarks, and a third map finds it.
  fine("map merge " + a + " " + b + " --into " + a);
  CHECK(nlohmann::json::parse(fine("map info --json " + a))["maps"][2]["map_id"] == 3);
}

TEST_CASE_METHOD(Forest, "what does not overlap is not merged, with the reason", "[cli]") {
  survey(a, 0.0, 45.0, {});
  survey(b, 55.0, 100.0, geometry::SE2(1.0, 2.0, 3.0));
  const Bytes before = read_bytes(a);
  refused("map merge " + a + " " + b + " --into " + a, 1, "not merged: no");
  CHECK((read_bytes(a) == before));
  refused("map merge " + a + " " + b + " --into " + path("c.gpkg"), 2, "neither of the two files");
  refused("map merge " + a + " " + path("none.gpkg"), 1, "none.gpkg: there is no such file");
  refused("map merge " + a + " " + path("stems.csv"), 1, "stems.csv: no map file");
  CHECK(run("map merge " + a + " " + b + " --into " + a + " --out " + path("c.gpkg")).status == 2);
  const map_file::MapFile in_use(a, Access::kWrite);
  refused("map merge " + a + " " + b + " --into " + a, 1, "a.gpkg");
}

TEST_CASE_METHOD(Forest, "maps that only a person can tell apart are merged by the pose they give",
                 "[cli]") {
  survey(a, 0.0, 52.0, {});
  survey(b, 48.0, 100.0, geometry::SE2(0.4, -0.3, 0.01).inverse());
  const Bytes before = read_bytes(a);
  refused("map merge " + a + " " + b + " --into " + a, 1, "not merged: ");
  const std::string said = "map merge " + a + " " + b + " --into " + a;
  const std::string pose = " --x-m 0.5 --y-m -0.2 --theta-deg 0.5 --pose-sigma-deg 0.3";
  refused(said + " --x-m 9 --y-m 9 --theta-deg 40", 1, "not merged: ");
  refused(said + " --force", 2, "--x-m is missing");
  refused(said + " --first-at submap:3" + pose, 1, "--first-at submap:3: map 1 has none");
  refused(said + " --first-at 3" + pose, 2, "--first-at 3: keyframe:N or submap:N");
  CHECK(run(said + " --x-m nan --y-m 0 --theta-deg 0").status != 0);
  CHECK((read_bytes(a) == before));

  const auto forced = json(said + pose + " --force");
  CHECK(forced["offset"]["x_m"].get<double>() == Approx(0.4).margin(0.2));
  CHECK(forced["landmarks"].get<int>() > 100);
  fine("map check " + a);
  fine("map revert --to 1 " + a);
  CHECK(map_file::MapFile(a, Access::kRead).maps().size() == 1);
}

TEST_CASE_METHOD(Forest, "two drives of one place on different days become one map", "[cli]") {
  sim::ForestParameters larger;
  larger.side_m = 220.0;
  larger.min_distance_m = 6.0;
  larger.jitter_sigma_m = 2.0;
  trees = sim::make_forest(larger, random).trunks_m;
  const auto drive = [&](const std::string& name, const std::string& map, int seed) {
    const std::string stems = table(name + ".csv", -50.0, 300.0, 0.64, 1e-4, {});
    fine(fmt::format("sim {} --path circle --length 120 --noise 0.1 --seed {} --out {}", stems,
                     seed, path(name + ".lcm")));
    fine("replay " + path(name + ".lcm") + " --config " UNDERSTORY_SOURCE_CONFIG " --out " +
         path(name + "-mapped.lcm"));
    fine("map import " + path(name + "-mapped.lcm") + " --out " + map);
  };
  drive("monday", a, 1);
  drive("tuesday", b, 2);
  const geometry::SE2 truth =
      map_T_world(path("monday.lcm"), a) * map_T_world(path("tuesday.lcm"), b).inverse();
  const auto report = json("map merge " + a + " " + b + " --into " + a);
  CHECK(report["doubled_pct"].get<double>() <= 1.0);
  CHECK(chi2_of(report, truth) < 16.3);
  fine("map check " + a);

  // The merged map serves: the second drive finds itself in it.
  fine("replay " + path("tuesday.lcm") + " --config " UNDERSTORY_SOURCE_CONFIG " --map " + a +
       " --localisation-only --out " + path("again.lcm"));
  std::size_t localised = 0;
  io::LcmLogReader reader(path("again.lcm"));
  while (const auto event = reader.next()) {
    if (event->channel == "SLAM_POSE")
      localised += wire::decode_message<model::SlamPose>(event->data)->is_localised() ? 1 : 0;
  }
  CHECK(localised > 500);
}
