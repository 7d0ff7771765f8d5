// A recorded drive through the command: import, replay, export.
#include <map>

#include "common/model/program_version.hpp"
#include "common/wire/convert.hpp"
#include "eval/experiments/victoria_park/victoria_park.hpp"
#include "tests/catch.hpp"
#include "tests/cli/recorded_drive.hpp"
#include "tests/cli/run_command.hpp"
#include "tests/data.hpp"
#include "understory/config_t.hpp"
#include "understory/ground_truth_t.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;
namespace fs = std::filesystem;

namespace {

struct Fixture {
  test::TemporaryDirectory directory;
  std::string log = (directory / "drive.lcm").string();

  test::Outcome run(const std::string& arguments) {
    return understory_command(directory, arguments);
  }
  void import(const std::string& recording) {
    const auto outcome = run("import victoria-park " + recording + " --out " + log);
    CAPTURE(outcome.error);
    REQUIRE(outcome.status == 0);
  }
  wire::Bytes replayed(const std::string& name) {
    const auto outcome =
        run("replay " + log +
            " --config " UNDERSTORY_SOURCE_CONFIG
            "/victoria_park --stages landmark_extractor,keyframer,geoslam_mapper --out " +
            (directory / name).string());
    CAPTURE(outcome.error);
    REQUIRE(outcome.status == 0);
    return test::read_bytes(directory / name);
  }
};

template <class T>
std::vector<T> messages(const std::vector<io::LogEvent>& events, const std::string& channel) {
  std::vector<T> found;
  for (const auto& event : events) {
    if (event.channel != channel) continue;
    auto message = wire::decode_message<T>(event.data);
    REQUIRE(message);
    found.push_back(std::move(*message));
  }
  return found;
}

std::vector<io::LogEvent> events_of(const fs::path& log) {
  io::LcmLogReader reader(log);
  return test::read_log(reader);
}

template <class T>
std::vector<wire::Bytes> encoded(const std::vector<T>& values) {
  std::vector<wire::Bytes> all;
  all.reserve(values.size());
  for (const T& value : values) all.push_back(wire::encode_message(value));
  return all;
}

/// What an importer must have written: exactly the recording, and its odometry.
void check_holds(const std::vector<io::LogEvent>& events, const io::VictoriaPark& recording) {
  const auto scans = messages<model::PlanarScan>(events, "LIDAR_SCAN");
  const bool same_scans = encoded(scans) == encoded(recording.scans);
  const bool same_wheels =
      encoded(messages<model::WheelSample>(events, "WHEELS")) == encoded(recording.wheels);
  const bool same_fixes =
      encoded(messages<model::GnssFix>(events, "GNSS")) == encoded(recording.gnss);
  CHECK(same_scans);
  CHECK(same_wheels);
  CHECK(same_fixes);

  const auto motions = messages<model::Odometry>(events, "ODOMETRY");
  const auto expected = eval::experiments::victoria_park::victoria_park_odometry(recording);
  REQUIRE(motions.size() == expected.size());

  for (std::size_t i = 0; i < motions.size(); ++i) {
    CHECK(motions[i].utime == expected[i].utime);
    CHECK(motions[i].from_utime == expected[i].from_utime);
    CHECK((motions[i].from_T_to.inverse() * expected[i].from_T_to).Log().norm() < 1e-12);
  }
}

/// Whoever takes a sweep has the motion up to it, and time never goes back.
void check_order(const std::vector<io::LogEvent>& events) {
  model::Utime newest = 0;
  model::Utime newest_motion = -1;
  std::size_t sweeps_without_motion = 0;
  for (const auto& event : events) {
    CHECK(event.utime >= newest);
    newest = event.utime;
    if (event.channel == "ODOMETRY") newest_motion = event.utime;
    if (event.channel == "LIDAR_SCAN" && newest_motion != event.utime) ++sweeps_without_motion;
  }
  CHECK(sweeps_without_motion <= 2);  // The first ones, before the first wheel reading.
}

}  // namespace

TEST_CASE_METHOD(Fixture, "an imported recording is all in the log, in order", "[cli][recording]") {
  const test::RecordedDrive drive;
  import(drive.path());
  const auto events = events_of(log);
  // And the program that made the log, in front.
  CHECK(events.size() == 1 + 2 * test::RecordedDrive::kScans - 1 +
                             test::RecordedDrive::kWheelSamples + test::RecordedDrive::kFixes);
  REQUIRE(events[0].channel == "CONFIG");
  const auto made_by = wire::decode_message<config_t>(events[0].data).value();
  CHECK(made_by.process == "understory import");
  CHECK(made_by.version == model::program_version());
  check_holds(events, io::read_victoria_park(drive.path()));
  check_order(events);
}

TEST_CASE_METHOD(Fixture, "odometry of exact wheels is the motion", "[cli][recording]") {
  const test::RecordedDrive drive;
  import(drive.path());
  geometry::SE2 reckoned;
  for (const auto& motion : messages<model::Odometry>(events_of(log), "ODOMETRY")) {
    reckoned = reckoned * motion.from_T_to;
    const geometry::SE2 truth = test::RecordedDrive::pose(1e-6 * static_cast<double>(motion.utime));
    CHECK((reckoned.inverse() * truth).Log().norm() < 1e-6);
  }
}

TEST_CASE_METHOD(Fixture, "replay of a recording maps the trunks, the same bytes every time",
                 "[cli][recording]") {
  const test::RecordedDrive drive;
  import(drive.path());
  const wire::Bytes first = replayed("first.lcm");
  const bool is_the_same = replayed("second.lcm") == first;
  CHECK(is_the_same);

  const auto events = events_of(directory / "first.lcm");
  const auto poses = messages<model::SlamPose>(events, "SLAM_POSE");
  const auto maps = messages<model::WholeMap>(events, "MAP");
  CHECK(poses.size() >= test::RecordedDrive::kScans - 16);
  for (const auto& pose : poses) {
    const geometry::SE2 truth = test::RecordedDrive::pose(1e-6 * static_cast<double>(pose.utime));
    CHECK(pose.is_localised());
    CHECK((pose.map_T_vehicle().translation() - truth.translation()).norm() < 0.15);
  }
  REQUIRE_FALSE(maps.empty());
  CHECK(maps.back().landmarks.size() > 50);
  for (const auto& one : maps.back().landmarks) CHECK(drive.to_trunk_m(one.position_m) < 0.3);
}

TEST_CASE_METHOD(Fixture, "the processes and the experiment make one map", "[cli][recording]") {
  const test::RecordedDrive drive;
  import(drive.path());
  replayed("out.lcm");
  const auto maps = messages<model::WholeMap>(events_of(directory / "out.lcm"), "MAP");
  const auto experiment = eval::experiments::victoria_park::drive_victoria_park(
      io::read_victoria_park(drive.path()),
      eval::experiments::victoria_park::victoria_park_defaults(), [] {});
  REQUIRE_FALSE(maps.empty());
  REQUIRE(maps.back().landmarks.size() == experiment.landmarks.size());

  for (std::size_t i = 0; i < experiment.landmarks.size(); ++i) {
    CHECK(maps.back().landmarks[i].id == experiment.landmarks[i].id);
    const auto apart = maps.back().landmarks[i].position_m - experiment.landmarks[i].position_m;
    CHECK(apart.norm() < 1e-6);
  }
}

TEST_CASE_METHOD(Fixture, "what was mapped is exported", "[cli][recording]") {
  const test::RecordedDrive drive;
  import(drive.path());
  replayed("out.lcm");
  const auto outcome = run("export " + (directory / "out.lcm").string() + " --out " +
                           (directory / "export").string());
  CHECK(outcome.status == 0);
  const auto events = events_of(directory / "out.lcm");
  const auto map = messages<model::WholeMap>(events, "MAP").back();

  CHECK(test::lines(test::read_text(directory / "export/landmarks.csv")) ==
        map.landmarks.size() + 1);
  CHECK(test::lines(test::read_text(directory / "export/keyframes.tum")) == map.keyframes.size());
  CHECK(test::lines(test::read_text(directory / "export/live.tum")) ==
        messages<model::SlamPose>(events, "SLAM_POSE").size());
  CHECK_THAT(test::read_text(directory / "export/graph.g2o"),
             Contains("VERTEX_XY") && Contains("EDGE_SE2_XY"));
}

TEST_CASE_METHOD(Fixture, "a recording that is not whole is named, and no log is left behind",
                 "[cli][recording]") {
  const test::RecordedDrive drive;
  fs::remove(fs::path(drive.path()) / "DRS.txt");
  const auto outcome = run("import victoria-park " + drive.path() + " --out " + log);
  CHECK(outcome.status == 1);
  CHECK(test::lines(outcome.error) == 1);
  CHECK_THAT(outcome.error, Contains("DRS.txt"));
  CHECK_FALSE(fs::exists(log));
}

TEST_CASE_METHOD(Fixture, "the Victoria Park set is imported as it is downloaded",
                 "[cli][recording][recorded]") {
  const fs::path archive = test::recording("victoria_park_raw/victoria_park_ascii.zip");
  import(archive.string());
  const auto events = events_of(log);
  CHECK(events.size() == 1 + 7230 + 7228 + 61'763 + 948);
  check_holds(events, io::read_victoria_park(archive));
  check_order(events);
}

TEST_CASE_METHOD(Fixture, "what no stage takes is an error, not an empty map", "[cli][recording]") {
  const test::RecordedDrive drive;
  import(drive.path());
  // lidar_imu_input makes ODOMETRY and LIDAR_SCAN itself, of what this log does not have.
  const auto outcome =
      run("replay " + log + " --config " UNDERSTORY_SOURCE_CONFIG "/victoria_park --out " +
          (directory / "out.lcm").string());
  CHECK(outcome.status == 1);
  CHECK(test::lines(outcome.error) == 1);
  CHECK_THAT(outcome.error, Contains("no event of it is an input of the stages") &&
                                Contains("LIDAR_SCAN") && Contains("left out"));
  CHECK_FALSE(fs::exists(directory / "out.lcm"));
}

TEST_CASE_METHOD(Fixture, "raw readings of the recorded car become a map", "[cli][recording]") {
  const test::RecordedDrive drive;
  REQUIRE(run("import victoria-park " + drive.path() + " --raw --out " + log).status == 0);
  const auto outcome =
      run("replay " + log + " --config " UNDERSTORY_SOURCE_CONFIG "/victoria_park --out " +
          (directory / "out.lcm").string());
  CAPTURE(outcome.error);
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.out, Contains("10 stages"));
  const auto maps = messages<model::WholeMap>(events_of(directory / "out.lcm"), "MAP");
  REQUIRE_FALSE(maps.empty());
  CHECK(maps.back().landmarks.size() > 50);
  for (const auto& one : maps.back().landmarks) CHECK(drive.to_trunk_m(one.position_m) < 0.3);
}

TEST_CASE_METHOD(Fixture, "poses of a laser become poses of the vehicle", "[cli][recording]") {
  // Two sweeps of no points; the laser turns about itself, so the vehicle moves.
  std::ofstream(directory / "sweeps.bin", std::ios::binary)
      << std::string("\0\0\0\0\0\0\0\0\1\0\0\0\0\0\0\0", 16);
  std::ofstream(directory / "poses_icp.csv") << "frame,t_s,x_m,y_m,z_m,qx,qy,qz,qw\n"
                                                "0,0.0,0,0,0,0,0,0,1\n"
                                                "1,0.1,0,0,0,0,0,1,0\n";
  const auto places = [&](const std::string& options) {
    const auto outcome =
        run("import kitti-reduced " + directory.path().string() + options + " --out " + log);
    CAPTURE(outcome.error);
    REQUIRE(outcome.status == 0);
    std::vector<Eigen::Vector2d> result;
    for (const io::LogEvent& event : events_of(log)) {
      if (event.channel != "GROUND_TRUTH") continue;
      const auto pose = wire::decode_message<ground_truth_t>(event.data)->world_T_vehicle;
      result.emplace_back(pose.x, pose.y);
    }
    REQUIRE(result.size() == 2);
    return result;
  };

  const auto of_kitti = places("");
  CHECK((of_kitti[0] - Eigen::Vector2d(-0.8105, 0.3072)).norm() < 2e-3);
  CHECK((of_kitti[1] - Eigen::Vector2d(0.8105, -0.3072)).norm() < 2e-3);
  const auto of_options = places(" --laser 2,0.5,0");
  CHECK((of_options[0] - Eigen::Vector2d(-2.0, -0.5)).norm() < 1e-9);
  CHECK((of_options[1] - Eigen::Vector2d(2.0, 0.5)).norm() < 1e-9);
}

TEST_CASE_METHOD(Fixture, "a KITTI drive is imported, and where its laser sits is told",
                 "[cli][recording][recorded]") {
  const fs::path folder = test::recording("kitti_raw_drive0002");
  const auto outcome = run("import kitti " + folder.string() + " --out " + log);
  CAPTURE(outcome.error);
  REQUIRE(outcome.status == 0);
  // The inverse of calib_imu_to_velo.txt.
  CHECK_THAT(outcome.out, Contains("x 0.8105 y -0.3071 z 0.8027 m, roll"));
}
