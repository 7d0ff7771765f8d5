// Bags through the command: the same log from every container, and a line for everything that a
// person must decide.
#include <cmath>
#include <fstream>
#include <map>

#include "common/wire/convert.hpp"
#include "tests/bag/bag_writer.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"
#include "tests/cli/simulated_bag.hpp"
#include "tests/io/velodyne_packets.hpp"
#include "tests/packets/made_up_sensor.hpp"
#include "understory/gnss_t.hpp"
#include "understory/ground_truth_t.hpp"
#include "understory/lidar_sweep_t.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

constexpr std::int64_t kStart_ns = SimulatedBag::kStart_ns;
constexpr double kWheelbase_m = 2.7;

/// Each channel's messages.
std::map<std::string, std::vector<Bytes>> channels_of(const std::filesystem::path& log) {
  std::map<std::string, std::vector<Bytes>> channels;
  io::LcmLogReader reader(log);
  while (auto event = reader.next()) channels[event->channel].push_back(std::move(event->data));
  return channels;
}

/// A folder with one bag.
struct BagFolder {
  TemporaryDirectory directory;

  std::string path(const std::string& name) const { return (directory / name).string(); }
  std::string write(const BagForm& form, const std::vector<Recorded>& messages) const {
    write_bag(directory / form.file(), form, messages);
    return path(form.file());
  }
  Outcome import(const std::string& bag, const std::string& more) const {
    return understory_command(directory, "import bag " + bag + " " + more);
  }
  void refused(const std::string& bag, const std::string& more, const std::string& what) const {
    const Outcome outcome = import(bag, more + " --out " + path("refused.lcm"));
    CAPTURE(more, outcome.out, outcome.error);
    CHECK(outcome.status != 0);
    CHECK(lines(outcome.error) == 1);
    CHECK_THAT(outcome.error, Contains(what));
    CHECK_FALSE(std::filesystem::exists(path("refused.lcm")));
  }
};

Recorded imu_at(std::int64_t time_ns, std::int64_t stamp_ns, const std::string& topic = "/imu") {
  return {topic, "sensor_msgs/Imu", time_ns,
          imu_message({bag::Encoding::kCdr, false}, {{stamp_ns, "imu"}, {0, 0, 0}, {0, 0, 9.81}})};
}

}  // namespace

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

TEST_CASE("import bag: mounts that /tf repeats, speed of a twist", "[import]") {
  const BagFolder folder;
  const Serialisation cdr{bag::Encoding::kCdr, false};
  std::vector<Recorded> messages;
  for (std::int64_t i = 0; i < 20; ++i) {
    const std::int64_t now = kStart_ns + i * 100'000'000;
    messages.push_back(imu_at(now, now));
    // As a publisher of static transforms does that knows no /tf_static.
    const std::vector<bag::Pose> transforms{
        frame_in("base_link", "imu", place(0.5, 0.0, 1.0)),
        frame_in("odom", "base_link", place(0.1 * static_cast<double>(i), 0.0, 0.0))};
    messages.push_back({"/tf", "tf2_msgs/TFMessage", now, transforms_message(cdr, transforms)});
    bag::Odometry odometry;
    odometry.pose.header = {now, "base_link"};
    odometry.velocity_mps.x() = 3.0;
    messages.push_back(
        {"/twist", "geometry_msgs/TwistStamped", now, twist_message(cdr, odometry, false)});
  }
  const std::string bag = folder.write({BagForm::Kind::kMcap}, messages);
  CHECK_THAT(folder.import(bag, "--list").out,
             Contains("mount: imu on base_link: x 0.500 y 0.000 z 1.000 m") &&
                 Contains("--odometry /twist"));
  const Outcome outcome = folder.import(bag, "--odometry /twist --out " + folder.path("run.lcm"));
  CHECK_THAT(outcome.out, Contains("20 wheel samples") && Contains("x_m = 0.500000"));
  CHECK(outcome.error.empty());
  folder.refused(bag, "--odometry /twist --speed-from-pose",
                 "geometry_msgs/TwistStamped has no pose");
}

TEST_CASE("import bag: a transform that is none costs no other one, two values are both told",
          "[import]") {
  const BagFolder folder;
  const Serialisation cdr{bag::Encoding::kCdr, false};
  bag::Pose broken = frame_in("base_link", "camera", place(1.0, 2.0, 3.0));
  broken.pose.translation().y() = std::nan("");
  const std::vector<bag::Pose> first{broken, frame_in("base_link", "imu", place(0.5, 0.0, 1.0)),
                                     frame_in("base_link", "mast", place(0.0, 0.0, 1.0))};
  // The same again is no contradiction.
  const std::vector<bag::Pose> second{frame_in("base_link", "imu", place(0.7, 0.0, 1.0, 0.5)),
                                      frame_in("base_link", "mast", place(0.0, 0.0, 1.0))};
  const std::string bag = folder.write(
      {BagForm::Kind::kMcap},
      {{"/tf_static", "tf2_msgs/TFMessage", kStart_ns, transforms_message(cdr, first)},
       {"/tf_static", "tf2_msgs/TFMessage", kStart_ns + 1, transforms_message(cdr, second)},
       imu_at(kStart_ns + 2, kStart_ns + 2)});
  const std::string of_camera = "camera in base_link: a transform whose numbers are no pose";
  const std::string of_imu =
      "imu: two static transforms, in base_link at (0.500, 0.000, 1.000) m, roll 0.00 pitch 0.00 "
      "yaw 0.00 deg and later in base_link at (0.700, 0.000, 1.000) m, roll 0.00 pitch 0.00 yaw "
      "28.65 deg: the later one counts";
  CHECK_THAT(folder.import(bag, "--list").out, Contains(of_camera) && Contains(of_imu));
  const Outcome outcome = folder.import(bag, "--out " + folder.path("run.lcm"));
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.out, Contains("x_m = 0.700000\nz_m = 1.000000\nyaw_rad = 0.500000"));
  CHECK_THAT(outcome.error, Contains(of_camera) && Contains(of_imu));
  CHECK(lines(outcome.error) == 2);
}

namespace {

/// The sweeps and samples that the packets hold, as they must stand in the log.
packets::Readings decoded(const MadeUpSensor& sensor, const MadeUpRecording& recording) {
  packets::Decoder decoder = packets::make_decoder(sensor.description);
  packets::Readings all;
  const auto take = [&](packets::Readings some) {
    for (auto& sweep : some.sweeps) all.sweeps.push_back(std::move(sweep));
    for (auto& sample : some.imu) all.imu.push_back(sample);
  };
  for (const SentPacket& packet : recording.packets)
    take(add(decoder, {packet.bytes, packet.sent}));
  if (auto last = finish(decoder)) all.sweeps.push_back(*std::move(last));
  return all;
}

/// The sweeps of a log, whole.
std::vector<model::PointSweep> sweeps_of(const std::string& log) {
  model::SweepAssembler assembler;
  std::vector<model::PointSweep> sweeps;
  auto channels = channels_of(log);
  for (const Bytes& bytes : channels["RAW_SWEEP"]) {
    const auto part = wire::decode_message<model::PointSweep>(bytes);
    REQUIRE(part);
    if (auto sweep = assembler.add(*part)) sweeps.push_back(*std::move(sweep));
  }
  return sweeps;
}

void check_same(const std::vector<model::PointSweep>& found,
                const std::vector<model::PointSweep>& expected) {
  REQUIRE(found.size() == expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    CHECK(found[i].utime == expected[i].utime);
    REQUIRE(found[i].points.size() == expected[i].points.size());
    for (std::size_t k = 0; k < found[i].points.size(); ++k) {
      const Eigen::Vector3f apart =
          found[i].points[k].position() - expected[i].points[k].position();
      // The wire's steps.
      CHECK(apart.norm() < 0.02F);
      CHECK(found[i].points[k].ring == expected[i].points[k].ring);
    }
  }
}

}  // namespace

TEST_CASE("import bag: the velocity of a frame becomes that of the vehicle", "[import]") {
  const BagFolder folder;
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  const Serialisation cdr{bag::Encoding::kCdr, false};
  // A frame on the vehicle, turned and beside its origin; the vehicle drives and turns.
  for (int i = 0; i < 10; ++i) {
    const Eigen::Isometry3d vehicle_T_frame =
        place(2.0 * number(random), number(random), 1.0, 3.0 * number(random));
    const double speed_mps = 3.0 + number(random);
    const Eigen::Vector3d rate_rad_s(0.0, 0.0, 0.3 * number(random));
    const Eigen::Vector3d there_mps =
        Eigen::Vector3d(speed_mps, 0.0, 0.0) + rate_rad_s.cross(vehicle_T_frame.translation());
    bag::Odometry odometry;
    odometry.pose.header = {kStart_ns, "gps"};
    odometry.velocity_mps = vehicle_T_frame.linear().transpose() * there_mps;
    odometry.angular_rate_rad_s = rate_rad_s;
    const std::vector<bag::Pose> mounts(1, frame_in("base_link", "gps", vehicle_T_frame));
    const std::vector<Recorded> messages{
        {"/tf_static", "tf2_msgs/TFMessage", kStart_ns, transforms_message(cdr, mounts)},
        {"/twist", "geometry_msgs/TwistStamped", kStart_ns, twist_message(cdr, odometry, false)}};
    const std::string bag = folder.write({BagForm::Kind::kMcap}, messages);
    const Outcome outcome = folder.import(bag, "--odometry /twist --out " + folder.path("run.lcm"));
    REQUIRE(outcome.status == 0);
    auto channels = channels_of(folder.path("run.lcm"));
    const auto wheels = wire::decode_message<model::WheelSample>(channels["RAW_WHEELS"].at(0));
    REQUIRE(wheels);
    CHECK(wheels->speed_mps == Approx(speed_mps).margin(1e-9));
    CHECK(wheels->steering_rad ==
          Approx(std::atan(kWheelbase_m * rate_rad_s.z() / speed_mps)).margin(1e-9));

    folder.refused(bag, "--odometry /twist --mount lasr=1,2,3",
                   "--mount lasr: no such frame; the bag has base_link, gps");
    odometry.velocity_mps.x() = std::nan("");
    const std::string damaged = folder.write(
        {BagForm::Kind::kMcap},
        {{"/twist", "geometry_msgs/TwistStamped", kStart_ns, twist_message(cdr, odometry, false)}});
    folder.refused(damaged, "--odometry /twist", "/twist, message 1: a velocity that is no number");
  }
}

TEST_CASE("import bag: turns on the spot and sideways motion, which no car makes, are told",
          "[import]") {
  const BagFolder folder;
  const Serialisation cdr{bag::Encoding::kCdr, false};
  std::vector<Recorded> messages;
  const auto drive = [&](std::int64_t count, const Eigen::Vector3d& velocity_mps, double rate) {
    for (std::int64_t i = 0; i < count; ++i) {
      const std::int64_t now = kStart_ns + static_cast<std::int64_t>(messages.size()) * 100'000'000;
      bag::Odometry odometry;
      odometry.pose.header = {now, "base_link"};
      odometry.velocity_mps = velocity_mps;
      odometry.angular_rate_rad_s.z() = rate;
      messages.push_back(
          {"/twist", "geometry_msgs/TwistStamped", now, twist_message(cdr, odometry, false)});
    }
  };
  // Standstill with the gyro's noise, and a curve with slip: as a car drives.
  drive(2, {0.0, 0.0, 0.0}, 0.01);
  drive(3, {5.0, 0.05, 0.0}, 0.3);
  const auto remarks = [&] {
    const std::string bag = folder.write({BagForm::Kind::kMcap}, messages);
    const Outcome outcome = folder.import(bag, "--odometry /twist --out " + folder.path("run.lcm"));
    REQUIRE(outcome.status == 0);
    return outcome.error;
  };
  CHECK(remarks().empty());

  drive(4, {0.0, 0.0, 0.0}, -0.5);
  drive(5, {0.0, 1.0, 0.0}, 0.0);
  drive(6, {0.05, -1.0, 0.0}, 0.5);
  const std::string said = remarks();
  CHECK_THAT(said, Contains("/twist: 10 of 20 messages turn by more than 0.02 rad/s at 0.1 m/s"));
  CHECK_THAT(said, Contains("/twist: 11 of 20 messages move sideways by more than 0.1 m/s"));
  CHECK(channels_of(folder.path("run.lcm"))["RAW_WHEELS"].size() == 20);
}

TEST_CASE("import bag: packets of Ouster's drivers, with the metadata of the bag", "[import]") {
  const BagFolder folder;
  std::mt19937_64 random(8);
  const Serialisation cdr{bag::Encoding::kCdr, false};
  const MadeUpSensor sensor = made_up_ousters().front();
  const MadeUpRecording recording = sensor.record(3, kStart_ns / 1000, random);
  std::vector<Recorded> messages;
  messages.push_back({"/ouster/metadata", "std_msgs/String", kStart_ns,
                      MessageWriter(cdr).text(sensor.description.description).bytes()});
  for (const SentPacket& packet : recording.packets) {
    const bool is_imu = packet.bytes.size() == packets::kOusterImuBytes;
    messages.push_back({is_imu ? "/ouster/imu_packets" : "/ouster/lidar_packets",
                        "ouster_sensor_msgs/PacketMsg", packet.sent * 1000,
                        MessageWriter(cdr).sequence(packet.bytes).bytes()});
  }
  const std::string bag = folder.write({BagForm::Kind::kMcap}, messages);
  CHECK_THAT(folder.import(bag, "--list").out,
             Contains("RAW_IMU") && Contains("RAW_SWEEP") && Contains("os_sensor"));
  const Outcome outcome =
      folder.import(bag, "--mount os_sensor=0,0,2 --out " + folder.path("run.lcm"));
  CAPTURE(outcome.error, outcome.out);
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.out, Contains("packets of ouster, 0 refused, 0 gaps"));
  const packets::Readings expected = decoded(sensor, recording);
  check_same(sweeps_of(folder.path("run.lcm")), expected.sweeps);
  CHECK(channels_of(folder.path("run.lcm"))["RAW_IMU"].size() == expected.imu.size());

  messages.erase(messages.begin());
  const std::string bare = folder.write({BagForm::Kind::kMcap}, messages);
  folder.refused(bare, "", "its metadata (JSON)");
}

TEST_CASE("import bag: packets of Hesai's drivers, in the driver's axes", "[import]") {
  const BagFolder folder;
  std::mt19937_64 random(9);
  const Serialisation cdr{bag::Encoding::kCdr, false};
  const MadeUpSensor sensor = made_up_hesais().front();
  const MadeUpRecording recording = sensor.record(3, kStart_ns / 1000, random);
  bag::PacketScan scan{{kStart_ns, "hesai_lidar"}, {}};
  for (const SentPacket& packet : recording.packets)
    scan.packets.push_back({packet.sent * 1000, packet.bytes});
  const std::string bag =
      folder.write({BagForm::Kind::kSqlite}, {{"/pandar_packets", "pandar_msgs/PandarScan",
                                               kStart_ns, scan_message(cdr, scan, true, 1500)}});
  const Outcome outcome = folder.import(bag, "--out " + folder.path("run.lcm"));
  CAPTURE(outcome.error, outcome.out);
  REQUIRE(outcome.status == 0);
  std::vector<model::PointSweep> expected = decoded(sensor, recording).sweeps;
  for (model::PointSweep& sweep : expected) {
    // The driver has y ahead and x to the right.
    for (model::SweepPoint& point : sweep.points) {
      const Eigen::Vector3f ahead_left_up = point.position();
      point.x_m = -ahead_left_up.y();
      point.y_m = ahead_left_up.x();
    }
  }
  check_same(sweeps_of(folder.path("run.lcm")), expected);
}

TEST_CASE("import bag: clocks that differ are named and laid onto the recorder's", "[import]") {
  const BagFolder folder;
  std::vector<Recorded> messages;
  const Serialisation cdr{bag::Encoding::kCdr, false};
  for (std::int64_t i = 0; i < 20; ++i) {
    const std::int64_t now = kStart_ns + i * 100'000'000;
    messages.push_back(imu_at(now, now - 2'000'000));
    // A sensor that counts from when it was switched on.
    model::PlanarScan scan;
    scan.bearing_step_rad = 0.1;
    scan.max_range_m = 30.0;
    scan.ranges_m = {1.0F, 2.0F};
    messages.push_back({"/scan", "sensor_msgs/LaserScan", now,
                        scan_message(cdr, {i * 100'000'000 + 50'000'000'000, "laser"}, scan)});
  }
  const std::string bag = folder.write({BagForm::Kind::kMcap}, messages);
  const std::string out = " --out " + folder.path("run.lcm");
  CHECK_THAT(folder.import(bag, "--list").out, Contains("--receive-time /scan"));
  CHECK_THAT(folder.import(bag, out).error, Contains("--receive-time /scan"));
  const Outcome mended = folder.import(bag, "--receive-time /scan" + out);
  REQUIRE(mended.status == 0);
  CHECK_THAT(mended.error, !Contains("--receive-time"));
  const auto scans = channels_of(folder.path("run.lcm"))["RAW_SCAN"];
  REQUIRE(scans.size() == 20);
  lidar_scan_t scan{};
  scan.decode(scans[3].data(), 0, static_cast<int>(scans[3].size()));
  CHECK(std::abs(scan.utime - (kStart_ns / 1000 + 300'000)) < 1000);
  folder.refused(bag, "--receive-time /none", "no such topic");
}

TEST_CASE("import bag: stamps of 0 are refused, or are the times of reception", "[import]") {
  const BagFolder folder;
  const Serialisation cdr{bag::Encoding::kCdr, false};
  std::vector<Recorded> messages;
  for (std::int64_t i = 0; i < 20; ++i) {
    const std::int64_t now = kStart_ns + i * 100'000'000;
    // A sender that knows its clock only after a while, and one that never does.
    messages.push_back(imu_at(now, i < 5 ? 0 : now));
    messages.push_back(
        {"/odom", "nav_msgs/Odometry", now,
         odometry_message(cdr,
                          {{{0, "odom"}, "base_link", place(0.2 * static_cast<double>(i), 0, 0)},
                           {0, 0, 0},
                           {0, 0, 0}})});
    model::PointSweep sweep;
    sweep.has_times = true;
    for (int k = 1; k < 100; ++k) {
      model::SweepPoint point;
      point.x_m = static_cast<float>(k);
      point.time_s = 1e-3F * static_cast<float>(k);
      sweep.points.push_back(point);
    }
    std::vector<std::uint8_t> data;
    messages.push_back({"/points", "sensor_msgs/PointCloud2", now,
                        cloud_message(cdr, cloud_of({0, "laser"}, sweep, data))});
  }
  const std::string bag = folder.write({BagForm::Kind::kMcap}, messages);
  const std::string odometry = "--odometry /odom --speed-from-pose ";
  const std::string of_imu =
      "/imu: the stamp of 5 of 20 messages is 0: --receive-time /imu takes the time of reception";
  CHECK_THAT(folder.import(bag, "--list").out, Contains(of_imu) && Contains("no stamp"));
  folder.refused(
      bag, "--cloud none",
      "/imu, message 1: its stamp is 0: --receive-time /imu takes the time of reception");
  folder.refused(bag, "--imu none", "/points, message 1: its stamp is 0: --receive-time /points");
  folder.refused(bag, odometry + "--imu none --cloud none", "/odom, message 1: its stamp is 0");

  const Outcome outcome = folder.import(
      bag, odometry + "--receive-time /imu --receive-time /points --receive-time /odom --out " +
               folder.path("run.lcm"));
  CAPTURE(outcome.error);
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.error, !Contains("stamp"));
  auto channels = channels_of(folder.path("run.lcm"));
  const auto utime_of = [&](const char* channel, std::size_t i, auto example) {
    const auto message = wire::decode_message<decltype(example)>(channels[channel].at(i));
    REQUIRE(message);
    return message->utime;
  };
  const auto sweeps = sweeps_of(folder.path("run.lcm"));
  REQUIRE(sweeps.size() == 20);
  for (std::int64_t i = 0; i < 20; ++i) {
    const model::Utime received = kStart_ns / 1000 + i * 100'000;
    const auto at = static_cast<std::size_t>(i);
    CHECK(utime_of("RAW_IMU", at, model::ImuSample{}) == received);
    CHECK(sweeps[at].utime == received);
    if (i > 0) CHECK(utime_of("RAW_WHEELS", at - 1, model::WheelSample{}) == received);
  }
  const auto wheels = wire::decode_message<model::WheelSample>(channels["RAW_WHEELS"].at(3));
  CHECK(wheels.value().speed_mps == Approx(2.0));
}

TEST_CASE("import bag --list: an IMU in g, upside down, tilted, without gravity", "[import]") {
  const BagFolder folder;
  const auto listed = [&](const Eigen::Vector3d& force) {
    const MessageBytes message =
        imu_message({bag::Encoding::kCdr, false}, {{kStart_ns, "base_link"}, {0, 0, 0}, force});
    const std::string bag =
        folder.write({BagForm::Kind::kMcap}, {{"/imu", "sensor_msgs/Imu", kStart_ns, message},
                                              {"/imu", "sensor_msgs/Imu", kStart_ns + 1, message}});
    return folder.import(bag, "--list").out;
  };
  CHECK_THAT(listed({0, 0, 9.8}), Contains("(0.00, 0.00, 9.80) m/s^2\n"));
  CHECK_THAT(listed({0, 0, 1.0}), Contains("in g"));
  CHECK_THAT(listed({0, 0, 0.1}), Contains("gravity is missing"));
  CHECK_THAT(listed({0, 0, -9.8}), Contains("points down"));
  CHECK_THAT(listed({9.8, 0, 0.3}), Contains("points sideways"));
}

TEST_CASE("import bag: odometry without a twist, and packets", "[import]") {
  const BagFolder folder;
  const Serialisation ros1{bag::Encoding::kRos1, false};
  std::vector<Recorded> messages;
  PacketMaker maker;
  MessageWriter packets(ros1);
  packets.header({kStart_ns, "velodyne"}).number(std::uint32_t{170});
  for (std::int64_t i = 0; i < 170; ++i) packets.stamp(kStart_ns + i * 1'327'104).raw(maker.next());
  messages.push_back(
      {"/velodyne_packets", "velodyne_msgs/VelodyneScan", kStart_ns, packets.bytes()});
  for (std::int64_t i = 0; i < 30; ++i) {
    const std::int64_t now = kStart_ns + i * 100'000'000;
    messages.push_back(
        {"/odom", "nav_msgs/Odometry", now,
         odometry_message(ros1,
                          {{{now, "odom"}, "base_link", place(0.2 * static_cast<double>(i), 0, 0)},
                           {0, 0, 0},
                           {0, 0, 0}})});
  }
  const std::string bag = folder.write({BagForm::Kind::kRos1, "lz4"}, messages);
  folder.refused(bag, "--odometry /odom", "--speed-from-pose");
  const Outcome outcome = folder.import(
      bag, "--odometry /odom --speed-from-pose --truth /odom --out " + folder.path("run.lcm"));
  CAPTURE(outcome.error);
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.out, Contains("170 packets of vlp16, 0 refused"));
  auto channels = channels_of(folder.path("run.lcm"));
  CHECK(channels["RAW_SWEEP"].size() >= 1);
  REQUIRE(channels["RAW_WHEELS"].size() == 29);
  CHECK(channels["GROUND_TRUTH"].size() == 30);
  const auto& bytes = channels["RAW_WHEELS"][5];
  const auto wheels = wire::decode_message<model::WheelSample>(bytes);
  REQUIRE(wheels);
  CHECK(wheels.value().speed_mps == Approx(2.0));
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
