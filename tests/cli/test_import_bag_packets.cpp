// Bags through the command: packets of lasers as their drivers record them.
#include <random>

#include "tests/catch.hpp"
#include "tests/cli/bag_folder.hpp"
#include "tests/io/velodyne_packets.hpp"
#include "tests/packets/made_up_sensor.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

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
