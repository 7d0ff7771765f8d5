// Bags through the command: the same log from every container, what --list says, and one line for
// everything that a person must decide.
#include <fstream>

#include "tests/catch.hpp"
#include "tests/cli/bag_folder.hpp"
#include "understory/gnss_t.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

TEST_CASE("import bag: every container gives what the sensors gave, byte for byte", "[import]") {
  const SimulatedDrive drive = SimulatedBag::record(4.0);
  const BagFolder folder;
  std::string first;
  for (const BagForm& form : all_bag_forms()) {
    CAPTURE(form.name());
    BagForm large = form;
    large.chunk_bytes = 700'000;
    const std::string bag = folder.write(large, drive.bag.at(form.encoding()));
    const std::string log = folder.path("run.lcm");
    const Outcome outcome =
        folder.import(bag, "--odometry /odom --truth /reference --max-range 100 --out " + log +
                               " --config " + folder.path("config"));
    CAPTURE(outcome.error);
    REQUIRE(outcome.status == 0);

    const auto channels = channels_of(log);
    for (const char* channel : {"RAW_SWEEP", "RAW_IMU", "RAW_WHEELS"})
      CHECK(channels.at(channel) == drive.log.at(channel));
    CHECK(channels.at("GROUND_TRUTH").size() > 100);
    CHECK(channels.at("RAW_GNSS").size() >= 7);
    // `map georeference --fixes` places maps by these.
    REQUIRE(channels.at("RAW_GNSS").size() == drive.latitude_longitude_deg.size());
    for (std::size_t i = 0; i < drive.latitude_longitude_deg.size(); ++i) {
      const auto fix = wire::decode_message<gnss_t>(channels.at("RAW_GNSS")[i]);
      REQUIRE(fix);
      CHECK(fix->has_geodetic != 0);
      CHECK(fix->latitude_deg == drive.latitude_longitude_deg[i].x());
      CHECK(fix->longitude_deg == drive.latitude_longitude_deg[i].y());
      CHECK(fix->altitude_m == 500.0);
    }
    if (first.empty()) first = file_bytes(log);
    CHECK(file_bytes(log) == first);
  }

  // Mounts are those of the chain of transforms; replay takes the folder as it is.
  const std::string settings = read_text(folder.path("config") + "/lidar_imu_input.toml");
  CHECK_THAT(settings, Contains("[imu.mount]\nx_m = 1.000000\nz_m = 0.600000\n"));
  CHECK_THAT(settings, Contains("[lidar.mount]\nx_m = 1.200000\nz_m = 1.900000\n"));
  const Outcome replay = understory_command(
      folder.directory, "replay " + folder.path("run.lcm") + " --config " + folder.path("config") +
                            " --out " + folder.path("replayed.lcm"));
  CAPTURE(replay.error);
  REQUIRE(replay.status == 0);

  // What a person edited in it stays.
  const std::string edited = settings + "# by hand\n";
  std::ofstream(folder.path("config") + "/lidar_imu_input.toml") << edited;
  const std::string bag =
      folder.write(all_bag_forms().front(), drive.bag.at(all_bag_forms().front().encoding()));
  const Outcome again =
      folder.import(bag, "--odometry /odom --max-range 100 --out " + folder.path("again.lcm") +
                             " --config " + folder.path("config"));
  CHECK(again.status == 1);
  CHECK_THAT(again.error, Contains("lidar_imu_input.toml is there already and reads otherwise"));
  CHECK(read_text(folder.path("config") + "/lidar_imu_input.toml") == edited);
  CHECK(channels_of(folder.path("replayed.lcm"))["LIDAR_SWEEP"].size() > 30);
}

TEST_CASE("import bag --list: topics, clocks, mounts, and what each becomes", "[import]") {
  const SimulatedDrive drive = SimulatedBag::record(4.0);
  const BagFolder folder;
  const std::string bag =
      folder.write({BagForm::Kind::kMcap, "zstd"}, drive.bag.at(bag::Encoding::kCdr));
  const Outcome outcome = folder.import(bag, "--list");
  REQUIRE(outcome.status == 0);
  for (const char* what :
       {"MCAP, ", "2023-11-14 22:13:20 UTC", "/points", "sensor_msgs/PointCloud2", "RAW_SWEEP",
        "200.00", "+0.000", "--odometry /odom or --truth /odom", "--truth /reference",
        "times: t (uint32, unit 1e-09 s, from the stamp); rings: ring, 16 counted upwards",
        "mount: laser on base_link: x 1.200 y 0.000 z 1.900 m"})
    CHECK_THAT(outcome.out, Contains(what));
}

TEST_CASE("import bag: what is ambiguous is asked for by name", "[import]") {
  const BagFolder folder;
  const std::string bag = folder.write({BagForm::Kind::kSqlite},
                                       {imu_at(kStart_ns, kStart_ns, "/a"),
                                        imu_at(kStart_ns, kStart_ns, "/b"),
                                        {"/chatter", "std_msgs/String", kStart_ns, {0, 1, 0, 0}}});
  folder.refused(bag, "", "which one is --imu: /a (sensor_msgs/Imu, 1 messages), /b");
  folder.refused(bag, "--imu /c", "no such topic; there are: /a");
  folder.refused(bag, "--imu /chatter", "its type is std_msgs/String");
  folder.refused(bag, "--imu none", "nothing that can be imported");
  folder.refused(bag, "--imu /a --mount imu=1,2", "FRAME=x,y,z");
  folder.refused(bag, "--list", "either --list or --out");
  const Outcome listed = folder.import(bag, "--list");
  CHECK_THAT(listed.out, Contains("--imu /a"));

  const Outcome outcome = folder.import(bag, "--imu /b --out " + folder.path("run.lcm"));
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.error, Contains("no static transform joins base_link and imu"));
  CHECK_THAT(outcome.error, Contains("--mount imu="));
  CHECK(channels_of(folder.path("run.lcm"))["RAW_IMU"].size() == 1);
  const Outcome stated =
      folder.import(bag, "--imu /b --mount imu=1,0,0.5,0,0,1.5 --out " + folder.path("run.lcm"));
  CHECK_THAT(stated.out, Contains("z_m = 0.500000\nyaw_rad = 1.500000"));
  CHECK(stated.error.empty());
}

TEST_CASE("import bag: a damaged message is named by file, topic and number", "[import]") {
  const BagFolder folder;
  auto messages =
      std::vector<Recorded>{imu_at(kStart_ns, kStart_ns), imu_at(kStart_ns + 1, kStart_ns),
                            imu_at(kStart_ns + 2, kStart_ns)};
  messages[1].data.resize(100);
  const std::string bag = folder.write({BagForm::Kind::kMcap, "lz4"}, messages);
  folder.refused(bag, "", bag + ": /imu, message 2: 104 bytes are wanted at byte 16 of 96");
  CHECK_THAT(folder.import(bag, "--list").out, Contains("/imu"));
}
